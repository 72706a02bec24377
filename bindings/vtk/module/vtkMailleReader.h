/**
 * @class vtkMailleReader
 * @brief reads .maille files, from disk or from a web server
 *
 * The output is vtkPolyData where all cells are vertices, lines, faces or strips, else vtkUnstructuredGrid;
 * with BlocksOn() a vtkPartitionedDataSetCollection with a named part for each block. Files of mode random
 * and volumes in pieces are shared by the processes of a parallel pipeline, each cell read by one of them; of
 * other files the first process has all. Names of blocks, labels and metadata are in the field data, as in
 * VTU files that maille writes. docs/vtk.md
 */
#ifndef vtkMailleReader_h
#define vtkMailleReader_h

#include <memory>  // for its state

#include <MailleVTKModule.h>  // for the export macro
#include <vtkDataObjectAlgorithm.h>

class vtkDataArraySelection;

class MAILLEVTK_EXPORT vtkMailleReader : public vtkDataObjectAlgorithm {
 public:
  static vtkMailleReader* New();
  vtkTypeMacro(vtkMailleReader, vtkDataObjectAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// A path, or an address (http://, https://).
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}
  /// Whether this is a .maille file, by its first bytes.
  int CanReadFile(const char* name);

  ///@{
  /// Which arrays are read; all at first. Known after UpdateInformation().
  vtkDataArraySelection* GetPointArraySelection();
  vtkDataArraySelection* GetCellArraySelection();
  int GetNumberOfPointArrays();
  int GetNumberOfCellArrays();
  const char* GetPointArrayName(int index);
  const char* GetCellArrayName(int index);
  int GetPointArrayStatus(const char* name);
  int GetCellArrayStatus(const char* name);
  void SetPointArrayStatus(const char* name, int status);
  void SetCellArrayStatus(const char* name, int status);
  ///@}

  ///@{
  /// Level of detail of a file of mode random: 0, the mesh itself, to GetNumberOfLevels() - 1.
  vtkSetClampMacro(Level, int, 0, 255);
  vtkGetMacro(Level, int);
  int GetNumberOfLevels();
  ///@}
  ///@{
  /// Mode random: the coarsest surface from which no point of the mesh is farther than this, in its units. 0:
  /// Level says how fine. With both the finer one of them is taken.
  vtkSetClampMacro(MaximumError, double, 0., VTK_DOUBLE_MAX);
  vtkGetMacro(MaximumError, double);
  ///@}
  ///@{
  /// Mode random: as detailed as it looks from a point of view, which refines what is near. Level and
  /// MaximumError take no part. Off at first.
  vtkSetMacro(UseView, bool);
  vtkGetMacro(UseView, bool);
  vtkBooleanMacro(UseView, bool);
  vtkSetVector3Macro(Eye, double);
  vtkGetVector3Macro(Eye, double);
  ///@}
  ///@{
  /// Height of the picture in pixels / (2 tan(vertical angle of view / 2)); 1000 at first.
  vtkSetClampMacro(PixelsPerRadian, double, 1e-9, VTK_DOUBLE_MAX);
  vtkGetMacro(PixelsPerRadian, double);
  /// How large an error may be seen; 1 at first.
  vtkSetClampMacro(Pixels, double, 0., VTK_DOUBLE_MAX);
  vtkGetMacro(Pixels, double);
  ///@}

  ///@{
  /// Only cells that meet a box (x, y and z from, to): of volumes those whose own box does, of surfaces those
  /// that have a point in it. Of files of mode random and volumes in pieces the rest is not read.
  vtkSetMacro(UseRegion, bool);
  vtkGetMacro(UseRegion, bool);
  vtkBooleanMacro(UseRegion, bool);
  vtkSetVector6Macro(Region, double);
  vtkGetVector6Macro(Region, double);
  ///@}

  ///@{
  /// A vtkPartitionedDataSetCollection with a named part for each block. Off at first.
  vtkSetMacro(Blocks, bool);
  vtkGetMacro(Blocks, bool);
  vtkBooleanMacro(Blocks, bool);
  ///@}

  ///@{
  /// Threads that decode; 0: as many as the machine has.
  vtkSetClampMacro(NumberOfThreads, int, 0, 1024);
  vtkGetMacro(NumberOfThreads, int);
  ///@}

 protected:
  vtkMailleReader();
  ~vtkMailleReader() override;

  int RequestDataObject(vtkInformation*, vtkInformationVector**, vtkInformationVector* output) override;
  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* output) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* output) override;

  char* FileName = nullptr;
  int Level = 0;
  double MaximumError = 0;
  bool UseView = false;
  double Eye[3] = {0, 0, 0};
  double PixelsPerRadian = 1000;
  double Pixels = 1;
  bool UseRegion = false;
  double Region[6] = {0, 1, 0, 1, 0, 1};
  bool Blocks = false;
  int NumberOfThreads = 0;

 private:
  vtkMailleReader(const vtkMailleReader&) = delete;
  void operator=(const vtkMailleReader&) = delete;

  struct State;
  /// Reads what the file says about itself, if that is not known. False: a message was given.
  bool ReadDescription();

  std::unique_ptr<State> OfFile;
};

#endif
