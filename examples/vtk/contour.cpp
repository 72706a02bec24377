// Reads a volume, cuts a contour out of it at each of its times, and writes the contours compressed.
//   contour VOLUME.maille ARRAY VALUE FOLDER
#include <vtkCellData.h>
#include <vtkContourFilter.h>
#include <vtkDataArraySelection.h>
#include <vtkInformation.h>
#include <vtkMailleReader.h>
#include <vtkMailleWriter.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

/// The times of a file; one that is never asked for where it has none.
std::vector<double> times_of(vtkMailleReader& reader) {
  reader.UpdateInformation();
  vtkInformation* const information = reader.GetOutputInformation(0);
  const auto key = vtkStreamingDemandDrivenPipeline::TIME_STEPS();
  if (!information->Has(key)) return {0};
  const double* const times = information->Get(key);
  return {times, times + information->Length(key)};
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) {
    std::fprintf(stderr, "contour VOLUME.maille ARRAY VALUE FOLDER\n");
    return 2;
  }
  vtkNew<vtkMailleReader> reader;
  reader->SetFileName(arguments[1]);  // or an address, https://...
  const std::vector<double> times = times_of(*reader);
  if (reader->GetErrorCode() != 0) return 1;  // VTK has said what is wrong

  // Nothing but this array is read.
  reader->GetPointArraySelection()->DisableAllArrays();
  reader->GetCellArraySelection()->DisableAllArrays();
  reader->SetPointArrayStatus(arguments[2], 1);

  vtkNew<vtkContourFilter> contour;
  contour->SetInputConnection(reader->GetOutputPort());
  contour->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, arguments[2]);
  contour->SetValue(0, std::atof(arguments[3]));
  for (size_t i = 0; i < times.size(); ++i) {
    contour->UpdateTimeStep(times[i]);
    vtkPolyData* const surface = contour->GetOutput();
    std::printf("time %g: %lld triangles\n", times[i], static_cast<long long>(surface->GetNumberOfCells()));
    vtkNew<vtkMailleWriter> writer;
    writer->SetInputData(surface);
    writer->SetFileName((std::string(arguments[4]) + "/contour_" + std::to_string(i) + ".maille").c_str());
    writer->KeepOrderOff();                               // a smaller file
    writer->SetTolerance("", vtkMailleWriter::BITS, 16);  // of positions: 65,536 steps along the longest side
    if (!writer->Write()) return 1;
  }
  return 0;
}
