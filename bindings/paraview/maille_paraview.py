"""Reads .maille files in ParaView where the compiled plug-in cannot be built: load it as a plug-in (Tools, Manage Plugins).

Needs the Python package maille for ParaView's own Python on PYTHONPATH. Whole files and their times; for parts, levels and many
processes there is the compiled plug-in (docs/vtk.md)."""
import maille
from paraview.util.vtkAlgorithm import smdomain, smproperty, smproxy
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline


@smproxy.reader(name='MaillePythonReader', label='Maille reader (Python)', extensions='maille', file_description='Maille meshes')
class MaillePythonReader(VTKPythonAlgorithmBase):
    def __init__(self):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType='vtkDataObject')
        self._name = None
        self._read = None  # what was asked for last, and what it gave

    @smproperty.stringvector(name='FileName')
    @smdomain.filelist()
    def SetFileName(self, name):
        if name != self._name:
            self._name = name
            self.Modified()

    @smproperty.doublevector(name='TimestepValues', information_only='1', si_class='vtkSITimeStepsProperty')
    def GetTimestepValues(self):
        return [step.time for step in maille.info(self._name).steps] if self._name else []

    def _data(self, step):
        if self._read is None or self._read[0] != (self._name, step):
            self._read = (self._name, step), maille.to_vtk(maille.read(self._name, step=step))
        return self._read[1]

    def RequestDataObject(self, request, inputs, outputs):
        data = self._data(1 if self.GetTimestepValues() else 0)
        information = outputs.GetInformationObject(0)
        information.Set(vtkDataObject.DATA_OBJECT(), vtkPolyData() if data.IsA('vtkPolyData') else vtkUnstructuredGrid())
        return 1

    def RequestInformation(self, request, inputs, outputs):
        times = self.GetTimestepValues()
        information = outputs.GetInformationObject(0)
        if times:
            information.Set(Pipeline.TIME_STEPS(), times, len(times))
            information.Set(Pipeline.TIME_RANGE(), [min(times), max(times)], 2)
        return 1

    def RequestData(self, request, inputs, outputs):
        information = outputs.GetInformationObject(0)
        times = self.GetTimestepValues()
        step = 0
        if times:
            asked = information.Get(Pipeline.UPDATE_TIME_STEP()) if information.Has(Pipeline.UPDATE_TIME_STEP()) else times[0]
            step = 1 + max((i for i, time in enumerate(times) if time <= asked), default=0)
        vtkDataObject.GetData(information).ShallowCopy(self._data(step))
        return 1
