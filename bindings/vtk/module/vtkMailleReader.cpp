#include "vtkMailleReader.h"

#include <maille/http.h>
#include <maille/stream.h>

#include <vtkCallbackCommand.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArraySelection.h>
#include <vtkErrorCode.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPartitionedDataSet.h>
#include <vtkPartitionedDataSetCollection.h>
#include <vtkPolyData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <filesystem>

#include "mesh_reading.h"
#include "mesh_to_vtk.h"

using maille::Domain;
using maille::FileInfo;
using maille::Mode;

struct vtkMailleReader::State {
  std::string name;   ///< of which file all else is
  std::string stamp;  ///< its size and time
  std::shared_ptr<const maille::Source> remote;
  FileInfo info;
  std::vector<maille::StreamStep> steps;
  std::vector<maille::FileTime> times;  ///< rising, each once
  vtkNew<vtkDataArraySelection> points, cells;
  vtkNew<vtkCallbackCommand> selected;

  maille::Result<std::shared_ptr<const maille::Source>> open() const {
    if (remote) return remote;
    return maille_vtk::open(name);
  }
  bool is_poly_data() const {
    return info.mode == Mode::random || (info.cells > 0 && maille_vtk::fits_poly_data(info.types));
  }
  /// The last step at or before a time, as VTK's readers do it; the first one for earlier times.
  uint64_t step_at(double time) const {
    uint64_t step = times.empty() ? 0 : times.front().step;
    for (const maille::FileTime& known : times) {
      if (known.time <= time) step = known.step;
    }
    return step;
  }
  void find_times();
  void find_arrays();
  maille::Result<> read();
  /// Leaves out what is not selected: an array on points may have the name of one on cells.
  void take_selected(maille::Mesh& mesh) const;
  std::optional<std::vector<std::string>> wanted() const;
  /// Of mode random: how fine.
  maille::Detail detail(const vtkMailleReader& reader) const;
};

namespace {

/// Size and time of a file: whether it is still the one that was looked at.
std::string stamp_of(const std::string& name) {
  std::error_code error;
  const auto time = std::filesystem::last_write_time(name, error);
  if (error) return "";
  return std::to_string(std::filesystem::file_size(name, error)) + " " +
         std::to_string(time.time_since_epoch().count());
}

}  // namespace

void vtkMailleReader::State::find_times() {
  times = maille::times_of(info);
  std::stable_sort(times.begin(), times.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  const auto same = [](const auto& a, const auto& b) { return a.time == b.time; };
  // VTK's pipeline names steps by their times, so one of two steps with the same time could never be asked
  // for.
  times.erase(std::unique(times.begin(), times.end(), same), times.end());
}

/// Those of the mesh, then those that only steps have. What was switched off before stays so.
void vtkMailleReader::State::find_arrays() {
  std::vector<std::string> names[2];
  const auto add = [&](const std::string& array, Domain domain) {
    if (domain != Domain::point && domain != Domain::cell) return;
    std::vector<std::string>& known = names[domain == Domain::cell];
    if (std::find(known.begin(), known.end(), array) == known.end()) known.push_back(array);
  };
  for (const maille::ArrayInfo& array : info.arrays) add(array.name, array.domain);
  for (const maille::StreamStep& step : steps) {
    for (const maille::StreamArray& array : step.arrays) add(array.name, array.domain);
  }
  for (const bool of_cells : {false, true}) {
    vtkDataArraySelection* const selection = of_cells ? cells.Get() : points.Get();
    vtkNew<vtkDataArraySelection> before;
    before->CopySelections(selection);
    selection->RemoveAllArrays();
    for (const std::string& array : names[of_cells]) {
      const bool off = before->ArrayExists(array.c_str()) && !before->ArrayIsEnabled(array.c_str());
      selection->AddArray(array.c_str(), !off);
    }
  }
}

maille::Result<> vtkMailleReader::State::read() {
  auto source = open();
  if (!source) return tl::unexpected(std::move(source).error());
  auto inspected = maille::inspect(**source);
  if (!inspected) return tl::unexpected(std::move(inspected).error());
  info = std::move(*inspected);
  steps.clear();
  if (!info.steps.empty()) {
    auto listed = maille::list_steps(**source);
    if (!listed) return tl::unexpected(std::move(listed).error());
    steps = std::move(*listed);
  }
  find_times();
  find_arrays();
  if (maille::is_url(name)) remote = std::move(*source);
  return {};
}

// By name only, as decode() has it: take_selected() then leaves out the array on points or cells that only
// shares the name. Without a value all are wanted, which also takes arrays that no list names.
std::optional<std::vector<std::string>> vtkMailleReader::State::wanted() const {
  std::vector<std::string> names;
  bool all = true;
  for (const auto& selection : {points.Get(), cells.Get()}) {
    for (int i = 0; i < selection->GetNumberOfArrays(); ++i) {
      const bool enabled = selection->GetArraySetting(i) != 0;
      all = all && enabled;
      if (enabled) names.emplace_back(selection->GetArrayName(i));
    }
  }
  if (all) return {};
  for (const maille::ArrayInfo& array : info.arrays) {
    if (array.domain == Domain::mesh) names.push_back(array.name);
  }
  return names;
}

maille::Detail vtkMailleReader::State::detail(const vtkMailleReader& reader) const {
  maille::Detail detail;
  if (reader.UseView) {
    const double* const eye = reader.Eye;
    detail.view = maille::View{{{eye[0], eye[1], eye[2]}}, reader.PixelsPerRadian, reader.Pixels};
    return detail;
  }
  // A bound, a level, or both: then the finer of the two. Without either, level 0, the mesh itself.
  if (reader.MaximumError > 0) detail.bound = reader.MaximumError;
  if (reader.MaximumError <= 0 || reader.Level != 0) detail.level = static_cast<uint32_t>(reader.Level);
  return detail;
}

void vtkMailleReader::State::take_selected(maille::Mesh& mesh) const {
  std::erase_if(mesh.arrays, [&](const maille::Array& array) {
    const auto& selection = array.domain == Domain::point ? points : cells;
    const bool selectable = array.domain == Domain::point || array.domain == Domain::cell;
    return selectable && selection->ArrayExists(array.name.c_str()) &&
           !selection->ArrayIsEnabled(array.name.c_str());
  });
}

vtkStandardNewMacro(vtkMailleReader);

vtkMailleReader::vtkMailleReader() : OfFile(std::make_unique<State>()) {
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(1);
  OfFile->selected->SetClientData(this);
  OfFile->selected->SetCallback([](vtkObject*, unsigned long, void* reader, void*) {
    static_cast<vtkMailleReader*>(reader)->Modified();
  });
  OfFile->points->AddObserver(vtkCommand::ModifiedEvent, OfFile->selected);
  OfFile->cells->AddObserver(vtkCommand::ModifiedEvent, OfFile->selected);
}

vtkMailleReader::~vtkMailleReader() {
  OfFile->points->RemoveObserver(OfFile->selected);
  OfFile->cells->RemoveObserver(OfFile->selected);
  this->SetFileName(nullptr);
}

void vtkMailleReader::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n"
     << indent << "Level: " << this->Level << "\n"
     << indent << "MaximumError: " << this->MaximumError << "\n"
     << indent << "UseView: " << this->UseView << "\n"
     << indent << "Eye: " << this->Eye[0] << " " << this->Eye[1] << " " << this->Eye[2] << "\n"
     << indent << "PixelsPerRadian: " << this->PixelsPerRadian << "\n"
     << indent << "Pixels: " << this->Pixels << "\n"
     << indent << "UseRegion: " << this->UseRegion << "\n"
     << indent << "Region: " << this->Region[0] << " " << this->Region[1] << " " << this->Region[2] << " "
     << this->Region[3] << " " << this->Region[4] << " " << this->Region[5] << "\n"
     << indent << "Blocks: " << this->Blocks << "\n"
     << indent << "NumberOfThreads: " << this->NumberOfThreads << "\n";
}

int vtkMailleReader::CanReadFile(const char* name) {
  if (!name) return 0;
  const auto source = maille_vtk::open(name);
  return source && maille::mode_of(**source) ? 1 : 0;
}

vtkDataArraySelection* vtkMailleReader::GetPointArraySelection() {
  return OfFile->points;
}
vtkDataArraySelection* vtkMailleReader::GetCellArraySelection() {
  return OfFile->cells;
}
int vtkMailleReader::GetNumberOfPointArrays() {
  return OfFile->points->GetNumberOfArrays();
}
int vtkMailleReader::GetNumberOfCellArrays() {
  return OfFile->cells->GetNumberOfArrays();
}
const char* vtkMailleReader::GetPointArrayName(int index) {
  return OfFile->points->GetArrayName(index);
}
const char* vtkMailleReader::GetCellArrayName(int index) {
  return OfFile->cells->GetArrayName(index);
}
int vtkMailleReader::GetPointArrayStatus(const char* name) {
  return OfFile->points->ArrayIsEnabled(name);
}
int vtkMailleReader::GetCellArrayStatus(const char* name) {
  return OfFile->cells->ArrayIsEnabled(name);
}
void vtkMailleReader::SetPointArrayStatus(const char* name, int status) {
  OfFile->points->SetArraySetting(name, status);
}
void vtkMailleReader::SetCellArrayStatus(const char* name, int status) {
  OfFile->cells->SetArraySetting(name, status);
}
int vtkMailleReader::GetNumberOfLevels() {
  return static_cast<int>(OfFile->info.faces_of_level.size());
}

bool vtkMailleReader::ReadDescription() {
  if (!this->FileName || !*this->FileName) {
    vtkErrorMacro("no file name: SetFileName() comes first");
    this->SetErrorCode(vtkErrorCode::NoFileNameError);
    return false;
  }
  const std::string stamp = stamp_of(this->FileName);
  // VTK calls this for each request of the pipeline; a file that did not change is not read again.
  const bool same = OfFile->name == this->FileName && OfFile->stamp == stamp;
  if (same && (!stamp.empty() || OfFile->remote)) return true;
  OfFile->remote.reset();
  OfFile->info = {};
  OfFile->name = this->FileName;
  if (const auto read = OfFile->read(); !read) {
    OfFile->name.clear();
    vtkErrorMacro(<< read.error().message);
    const bool found = read.error().code != maille::ErrorCode::cannot_read;
    this->SetErrorCode(found ? vtkErrorCode::FileFormatError : vtkErrorCode::CannotOpenFileError);
    return false;
  }
  OfFile->stamp = stamp;
  this->SetErrorCode(vtkErrorCode::NoError);
  return true;
}

int vtkMailleReader::RequestDataObject(vtkInformation*, vtkInformationVector**,
                                       vtkInformationVector* output) {
  const bool known = this->ReadDescription();
  vtkInformation* const information = output->GetInformationObject(0);
  vtkSmartPointer<vtkDataObject> wanted;
  if (this->Blocks) {
    wanted = vtkSmartPointer<vtkPartitionedDataSetCollection>::New();
  } else if (known && OfFile->is_poly_data()) {
    wanted = vtkSmartPointer<vtkPolyData>::New();
  } else {
    wanted = vtkSmartPointer<vtkUnstructuredGrid>::New();
  }
  vtkDataObject* const there = vtkDataObject::GetData(information);
  // Replacing an output of the right type would make filters behind it run again.
  if (there && there->GetDataObjectType() == wanted->GetDataObjectType()) return 1;
  information->Set(vtkDataObject::DATA_OBJECT(), wanted);
  return 1;
}

int vtkMailleReader::RequestInformation(vtkInformation*, vtkInformationVector**,
                                        vtkInformationVector* output) {
  using Pipeline = vtkStreamingDemandDrivenPipeline;
  if (!this->ReadDescription()) return 1;  // said already; the output stays empty
  vtkInformation* const information = output->GetInformationObject(0);
  // Each process of pvserver asks for its own share; only a file of mode single, which has no parts, is read
  // whole by the first.
  information->Set(vtkAlgorithm::CAN_HANDLE_PIECE_REQUEST(), 1);
  information->Remove(Pipeline::TIME_STEPS());
  information->Remove(Pipeline::TIME_RANGE());
  std::vector<double> times;
  for (const maille::FileTime& time : OfFile->times) times.push_back(time.time);
  if (times.empty()) return 1;
  const double range[] = {times.front(), times.back()};
  information->Set(Pipeline::TIME_STEPS(), times.data(), static_cast<int>(times.size()));
  information->Set(Pipeline::TIME_RANGE(), range, 2);
  return 1;
}

namespace {

void fill_collection(const maille::Mesh& mesh, vtkPartitionedDataSetCollection& collection) {
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    const maille::CellBlock& block = mesh.blocks[b];
    const auto fits = [](uint8_t type) {
      return maille_vtk::fits_poly_data(static_cast<maille::CellType>(type));
    };
    const bool poly_data = block.type == maille::CellType::mixed
                               ? std::all_of(block.types.begin(), block.types.end(), fits)
                               : maille_vtk::fits_poly_data(block.type);
    const auto index = static_cast<unsigned>(b);
    collection.SetPartition(index, 0, maille_vtk::to_vtk(maille_vtk::block_of(mesh, b), poly_data));
    const std::string name = block.name.empty() ? "block " + std::to_string(b) : block.name;
    collection.GetMetaData(index)->Set(vtkCompositeDataSet::NAME(), name.c_str());
  }
}

}  // namespace

int vtkMailleReader::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* output) {
  using Pipeline = vtkStreamingDemandDrivenPipeline;
  vtkInformation* const information = output->GetInformationObject(0);
  vtkDataObject* const data = vtkDataObject::GetData(information);
  data->Initialize();
  if (!this->ReadDescription()) return 1;

  maille_vtk::Request request;
  const bool asks = information->Has(Pipeline::UPDATE_TIME_STEP()) != 0;
  const double first = OfFile->times.empty() ? 0 : OfFile->times.front().time;
  const double time = asks ? information->Get(Pipeline::UPDATE_TIME_STEP()) : first;
  if (!OfFile->times.empty()) request.options.step = OfFile->step_at(time);
  if (information->Has(Pipeline::UPDATE_NUMBER_OF_PIECES())) {
    request.pieces =
        static_cast<unsigned>(std::max(information->Get(Pipeline::UPDATE_NUMBER_OF_PIECES()), 1));
    request.piece = static_cast<unsigned>(std::max(information->Get(Pipeline::UPDATE_PIECE_NUMBER()), 0));
  }
  if (this->UseRegion) {
    const double* const r = this->Region;
    request.box = maille::Box{{{r[0], r[2], r[4]}}, {{r[1], r[3], r[5]}}};
  }
  if (OfFile->info.mode == Mode::random) request.detail = OfFile->detail(*this);
  request.options.arrays = OfFile->wanted();
  request.options.executor = maille_vtk::threads(static_cast<unsigned>(this->NumberOfThreads));
  request.options.progress = [this](const maille::ProgressReport& report) {
    this->SetProgressText(report.stage);
    // Converting the mesh takes the rest.
    this->UpdateProgress(0.9 * report.fraction);
    return !this->GetAbortExecute();
  };

  const auto source = OfFile->open();
  auto answer = source ? maille_vtk::read(**source, OfFile->info, request)
                       : maille::Result<maille_vtk::Answer>(tl::unexpected(source.error()));
  if (!answer) {
    // The user stopped it, which is no error.
    if (answer.error().code == maille::ErrorCode::cancelled) return 1;
    vtkErrorMacro(<< answer.error().message);
    this->SetErrorCode(vtkErrorCode::FileFormatError);
    return 1;
  }
  for (const std::string& problem : answer->problems) vtkWarningMacro(<< problem);
  OfFile->take_selected(answer->mesh);
  if (auto* const collection = vtkPartitionedDataSetCollection::SafeDownCast(data)) {
    fill_collection(answer->mesh, *collection);
  } else {
    data->ShallowCopy(maille_vtk::to_vtk(answer->mesh, data->IsA("vtkPolyData")));
  }
  if (!OfFile->times.empty()) data->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
  this->UpdateProgress(1);
  return 1;
}
