"""Reads and writes .maille files with VTK: vtkMailleReader, vtkMailleWriter."""
from .MailleVTK import vtkMailleReader, vtkMailleWriter

__all__ = ['vtkMailleReader', 'vtkMailleWriter']
