/**
 * @class vtkMailleWriter
 * @brief writes .maille files
 *
 * Takes any vtkDataSet. Lossless unless bounds are set. With WriteAllTimeStepsOn() the values of later times
 * are steps behind the mesh, which is that of the first. What the format does not hold is told by a warning.
 * docs/vtk.md
 */
#ifndef vtkMailleWriter_h
#define vtkMailleWriter_h

#include <memory>  // for its state

#include <MailleVTKModule.h>  // for the export macro
#include <vtkWriter.h>

class MAILLEVTK_EXPORT vtkMailleWriter : public vtkWriter {
 public:
  static vtkMailleWriter* New();
  vtkTypeMacro(vtkMailleWriter, vtkWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// The file appears whole or not at all.
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  enum FileMode { AUTOMATIC = 0, SINGLE = 1, STREAM = 2, RANDOM = 3 };
  ///@{
  /// SINGLE: smallest, read whole. STREAM: volumes, in little memory, with steps of time. RANDOM: surfaces of
  /// which any part is read at any level of detail. AUTOMATIC, the default: STREAM where there are solids or
  /// times, else SINGLE.
  vtkSetClampMacro(Mode, int, AUTOMATIC, RANDOM);
  vtkGetMacro(Mode, int);
  ///@}
  ///@{
  /// From 1 (fast) to 9 (small); 5 at first.
  vtkSetClampMacro(Effort, int, 1, 9);
  vtkGetMacro(Effort, int);
  ///@}
  ///@{
  /// Points and cells come back in the order in which they are. Always so in mode STREAM; on at first.
  vtkSetMacro(KeepOrder, bool);
  vtkGetMacro(KeepOrder, bool);
  vtkBooleanMacro(KeepOrder, bool);
  ///@}
  ///@{
  /// Mode STREAM: volumes are cut into pieces of space of about so many cells, which are read alone, and by
  /// several processes. 0, the default: one piece. 262144 suits most uses. Mode RANDOM: triangles of a chart
  /// of the finest level; 4096 if 0.
  vtkSetClampMacro(CellsPerPiece, int, 0, VTK_INT_MAX);
  vtkGetMacro(CellsPerPiece, int);
  ///@}

  /// How far values may be from the original ones, as maille::Tolerance has it.
  enum ToleranceKind {
    LOSSLESS = 0,   ///< bit for bit
    ABSOLUTE = 1,   ///< for each component
    RELATIVE = 2,   ///< of the diagonal of the box (positions) or the range
    BITS = 3,       ///< a lattice of 2^value points along the longest side or range
    NORM = 4,       ///< the length of the difference, all components together
    PSNR = 5,       ///< decibels
    POINTWISE = 6,  ///< of each number; mode STREAM only
  };
  /// For the array of this name, on points or cells; for positions with an empty name. A name that no array
  /// has is an error when the file is written.
  void SetTolerance(const char* array, int kind, double value);
  /// The same as ABSOLUTE.
  void SetErrorBound(const char* array, double value) { this->SetTolerance(array, ABSOLUTE, value); }
  /// ABSOLUTE, of positions.
  void SetPositionError(double value) { this->SetTolerance("", value > 0 ? ABSOLUTE : LOSSLESS, value); }
  /// All arrays are lossless again.
  void ClearErrorBounds();
  /// And positions.
  void ClearTolerances();

  ///@{
  /// All times that the pipeline has, not the current one alone.
  vtkSetMacro(WriteAllTimeSteps, bool);
  vtkGetMacro(WriteAllTimeSteps, bool);
  vtkBooleanMacro(WriteAllTimeSteps, bool);
  ///@}

  ///@{
  /// Threads that encode; 0: as many as the machine has. The file is the same for any number.
  vtkSetClampMacro(NumberOfThreads, int, 0, 1024);
  vtkGetMacro(NumberOfThreads, int);
  ///@}

  vtkTypeBool ProcessRequest(vtkInformation* request, vtkInformationVector** input,
                             vtkInformationVector* output) override;

 protected:
  vtkMailleWriter();
  ~vtkMailleWriter() override;

  int FillInputPortInformation(int port, vtkInformation* information) override;
  int RequestData(vtkInformation* request, vtkInformationVector** input,
                  vtkInformationVector* output) override;
  void WriteData() override;

  char* FileName = nullptr;
  int Mode = AUTOMATIC;
  int Effort = 5;
  bool KeepOrder = true;
  int CellsPerPiece = 0;
  bool WriteAllTimeSteps = false;
  int NumberOfThreads = 0;

 private:
  vtkMailleWriter(const vtkMailleWriter&) = delete;
  void operator=(const vtkMailleWriter&) = delete;

  struct State;
  bool Fail(const std::string& message);

  std::unique_ptr<State> Writing;
};

#endif
