#include "faults/entry_points.h"

#include <maille/file.h>
#include <maille/random_access.h>
#include <maille/stream.h>
#include <maille/volume_file.h>

#include <algorithm>
#include <set>

namespace maille::testing {
namespace {

constexpr Vector3 somewhere = {{0.3, -0.2, 0.4}};

/// Takes down what comes of each question.
class Questions {
 public:
  Questions(Bytes file, const Limits& limits) : source_(memory_source(file, "x.maille")) {
    options_.limits = limits;
  }

  void ask_all() {
    take("inspect", inspect(*source_, options_.limits));
    take("verify", verify_checksums(*source_));
    take_mesh("decode", decode(*source_, options_), false);
    auto saved = salvage(*source_, options_);
    if (take("salvage", saved)) add_mesh("salvage", std::move(saved->mesh), true);
    ask_steps();
    ask_stream();
    ask_pieces();
    ask_charts();
  }
  std::vector<Answer> take_answers() { return std::move(answers_); }

 private:
  template <class Value>
  bool take(const char* asked, const Result<Value>& result) {
    if (result) return true;
    answers_.push_back({asked, result.error(), {}, false});
    return false;
  }
  void add_mesh(const char* asked, Mesh&& mesh, bool may_be_part) {
    answers_.push_back({asked, {}, std::move(mesh), may_be_part});
  }
  void take_mesh(const char* asked, Result<Mesh>&& mesh, bool may_be_part) {
    if (take(asked, mesh)) add_mesh(asked, *std::move(mesh), may_be_part);
  }

  void ask_steps() {
    const auto steps = list_steps(*source_, true, options_.limits);
    if (!take("steps", steps) || steps->empty()) return;
    DecodeOptions of_step = options_;
    of_step.step = steps->size();
    take_mesh("step", decode(*source_, of_step), true);
  }

  void ask_stream() {
    StreamReadOptions portions;
    portions.limits = options_.limits;
    portions.any_order = true;
    auto reader = StreamReader::open(source_stream(*source_), portions);
    if (!take("stream", reader)) return;
    StreamPortion portion;
    for (;;) {
      const auto more = reader->next(portion);
      if (!take("portion", more) || !*more) return;
    }
  }

  void ask_pieces() {
    const auto volume = VolumeFile::open(*source_, options_);
    if (!take("pieces", volume)) return;
    VolumeQuery query;
    query.region.box = Box{{{-0.5, -0.5, -0.5}}, {{0.5, 0.5, 0.5}}};
    auto found = volume->extract(query);
    if (take("extract cells", found)) add_mesh("extract cells", std::move(found->mesh), true);
    query.region = {};
    query.plane = Region::Plane{};
    take("cells on a plane", volume->select(query));
    take_mesh("coarse", volume->coarse(), true);
  }

  void ask_charts() {
    auto file = File::open(*source_, options_);
    if (!take("charts", file)) return;
    if (const auto selection = file->select({}, Detail::full()); take("select", selection)) {
      take_mesh("extract", file->extract(*selection), true);
      std::vector<std::string> problems;
      take_mesh("salvage charts", file->salvage(*selection, problems), true);
    }
    Detail coarse;
    coarse.view = View{somewhere, 1000, 1};
    if (const auto selection = file->select({}, coarse); take("select for a view", selection))
      take_mesh("extract for a view", file->extract(*selection), true);
    search(*file);
  }
  void search(File& file) {
    take("hit", file.hit(somewhere, {{-0.3, 0.25, -0.4}}));
    take("nearest", file.nearest(somewhere));
    const auto points = file.nearest_points(somewhere, 5);
    if (!take("nearest points", points) || points->empty()) return;
    const auto component = file.component(points->front().chart, points->front().point);
    if (take("component", component)) take_mesh("extract component", file.extract(*component), true);
  }

  std::unique_ptr<Source> source_;
  DecodeOptions options_;
  std::vector<Answer> answers_;
};

}  // namespace

std::vector<Answer> ask_everything(Bytes file, const Limits& limits) {
  Questions questions(file, limits);
  questions.ask_all();
  return questions.take_answers();
}

std::string fault_of(const Answer& answer) {
  static const std::set<ErrorCode> fitting = {ErrorCode::corrupt, ErrorCode::unsupported,
                                              ErrorCode::memory_bound, ErrorCode::usage};
  if (answer.error && fitting.count(answer.error->code) == 0)
    return answer.asked + ": an odd error: " + answer.error->message;
  if (answer.error && answer.error->message.empty()) return answer.asked + ": an error without a word";
  if (!answer.mesh) return {};
  const auto valid = validate(*answer.mesh);
  return valid ? std::string() : answer.asked + ": the mesh is not valid: " + valid.error().message;
}

}  // namespace maille::testing
