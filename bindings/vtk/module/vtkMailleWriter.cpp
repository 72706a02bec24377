#include "vtkMailleWriter.h"

#include <maille/encode.h>
#include <maille/stream.h>

#include <vtkDataSet.h>
#include <vtkErrorCode.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "mesh_reading.h"
#include "vtk_to_mesh.h"

using maille::Tolerance;

struct vtkMailleWriter::State {
  Tolerance positions;
  std::map<std::string, Tolerance> arrays;
  std::vector<double> times;  ///< of the pipeline
  size_t next = 0;            ///< of them is written now
  std::string part;           ///< the file while its times are written

  bool is_series(const vtkMailleWriter& writer) const { return writer.WriteAllTimeSteps && times.size() > 1; }
  maille::EncodeOptions options(const vtkMailleWriter& writer, const maille::Mesh& mesh) const;
};

maille::EncodeOptions vtkMailleWriter::State::options(const vtkMailleWriter& writer,
                                                      const maille::Mesh& mesh) const {
  constexpr maille::Mode modes[] = {maille::Mode::single, maille::Mode::single, maille::Mode::stream,
                                    maille::Mode::random};
  maille::EncodeOptions options;
  options.mode = writer.Mode != AUTOMATIC ? modes[writer.Mode]
                 : is_series(writer)      ? maille::Mode::stream
                                          : maille::usual_mode(mesh);
  const bool stream = options.mode == maille::Mode::stream;
  options.order = writer.KeepOrder || stream ? maille::Order::keep : maille::Order::canonical;
  options.effort = writer.Effort;
  options.positions = positions;
  options.arrays = arrays;
  if (options.mode != maille::Mode::single && writer.CellsPerPiece > 0)
    options.most_cells_per_part = static_cast<uint64_t>(writer.CellsPerPiece);
  options.executor = maille_vtk::threads(static_cast<unsigned>(writer.NumberOfThreads));
  return options;
}

vtkStandardNewMacro(vtkMailleWriter);

vtkMailleWriter::vtkMailleWriter() : Writing(std::make_unique<State>()) {}

vtkMailleWriter::~vtkMailleWriter() {
  this->SetFileName(nullptr);
}

void vtkMailleWriter::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n"
     << indent << "Mode: " << this->Mode << "\n"
     << indent << "Effort: " << this->Effort << "\n"
     << indent << "KeepOrder: " << this->KeepOrder << "\n"
     << indent << "CellsPerPiece: " << this->CellsPerPiece << "\n"
     << indent << "WriteAllTimeSteps: " << this->WriteAllTimeSteps << "\n"
     << indent << "NumberOfThreads: " << this->NumberOfThreads << "\n";
}

void vtkMailleWriter::SetTolerance(const char* array, int kind, double value) {
  if (kind < LOSSLESS || kind > POINTWISE) {
    vtkErrorMacro("no kind of tolerance: " << kind);
    return;
  }
  const Tolerance tolerance{static_cast<Tolerance::Kind>(kind), value};
  if (!array || !*array) {
    Writing->positions = tolerance;
  } else {
    Writing->arrays[array] = tolerance;
  }
  this->Modified();
}

void vtkMailleWriter::ClearErrorBounds() {
  Writing->arrays.clear();
  this->Modified();
}

void vtkMailleWriter::ClearTolerances() {
  Writing->positions = {};
  this->ClearErrorBounds();
}

int vtkMailleWriter::FillInputPortInformation(int, vtkInformation* information) {
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataSet");
  return 1;
}

// After an error the writer is as if nothing had begun: the next Write() starts with the first time.
bool vtkMailleWriter::Fail(const std::string& message) {
  vtkErrorMacro(<< message);
  this->SetErrorCode(vtkErrorCode::UnknownError);
  std::error_code ignored;
  if (!Writing->part.empty()) std::filesystem::remove(Writing->part, ignored);
  Writing->part.clear();
  Writing->next = 0;
  return false;
}

vtkTypeBool vtkMailleWriter::ProcessRequest(vtkInformation* request, vtkInformationVector** input,
                                            vtkInformationVector* output) {
  using Pipeline = vtkStreamingDemandDrivenPipeline;
  vtkInformation* const information = input[0]->GetInformationObject(0);
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_INFORMATION())) {
    Writing->times.clear();
    if (information && information->Has(Pipeline::TIME_STEPS())) {
      const double* const times = information->Get(Pipeline::TIME_STEPS());
      Writing->times.assign(times, times + information->Length(Pipeline::TIME_STEPS()));
    }
  }
  if (request->Has(Pipeline::REQUEST_UPDATE_EXTENT()) && information && Writing->is_series(*this))
    information->Set(Pipeline::UPDATE_TIME_STEP(), Writing->times[Writing->next]);
  return this->Superclass::ProcessRequest(request, input, output);
}

int vtkMailleWriter::RequestData(vtkInformation* request, vtkInformationVector** input,
                                 vtkInformationVector* output) {
  this->SetErrorCode(vtkErrorCode::NoError);
  if (!this->FileName || !*this->FileName) {
    this->Fail("no file name: SetFileName() comes first");
    this->SetErrorCode(vtkErrorCode::NoFileNameError);
    return 0;
  }
  const int done = this->Superclass::RequestData(request, input, output);
  const bool failed = !done || this->GetErrorCode() != vtkErrorCode::NoError;
  // The pipeline runs again with the next time, so only one time is in memory.
  if (!failed && Writing->is_series(*this) && ++Writing->next < Writing->times.size()) {
    request->Set(vtkStreamingDemandDrivenPipeline::CONTINUE_EXECUTING(), 1);
    return 1;
  }
  request->Remove(vtkStreamingDemandDrivenPipeline::CONTINUE_EXECUTING());
  Writing->next = 0;
  if (failed || Writing->part.empty()) return failed ? 0 : 1;
  std::error_code error;
  // A series is written under another name and appears when its last step is in it.
  std::filesystem::rename(Writing->part, this->FileName, error);
  if (error) return this->Fail(std::string(this->FileName) + ": " + error.message());
  Writing->part.clear();
  return 1;
}

void vtkMailleWriter::WriteData() {
  auto* const data = vtkDataSet::SafeDownCast(this->GetInput());
  auto converted = maille_vtk::from_vtk(*data);
  if (!converted) {
    this->Fail(converted.error().message);
    return;
  }
  const maille::Mesh& mesh = converted->mesh;
  maille::EncodeOptions options = Writing->options(*this, mesh);
  options.progress = [this](const maille::ProgressReport& report) {
    this->SetProgressText(report.stage);
    this->UpdateProgress(report.fraction);
    return !this->GetAbortExecute();
  };
  const bool series = Writing->is_series(*this);
  if (Writing->next == 0) {
    for (const std::string& note : converted->notes) vtkWarningMacro(<< note);
    vtkInformation* const information = data->GetInformation();
    if (information->Has(vtkDataObject::DATA_TIME_STEP()))
      options.time = information->Get(vtkDataObject::DATA_TIME_STEP());
    if (series) options.time = Writing->times[0];
    // The name is there while the pipeline runs again and again; Fail() removes the file.
    if (series) Writing->part = std::string(this->FileName) + ".part";
    auto sink = maille::file_sink(series ? Writing->part : this->FileName);
    if (!sink) {
      this->Fail(sink.error().message);
      return;
    }
    if (const auto done = maille::encode(mesh, **sink, options); !done) this->Fail(done.error().message);
    return;
  }
  const auto done = maille::append_step(Writing->part, Writing->times[Writing->next], mesh, options);
  if (!done) this->Fail(done.error().message);
}
