#include "random/random_layout.h"

#include <cmath>
#include <string>
#include <type_traits>

#include "container/plain_fields.h"

namespace maille {
namespace {

constexpr uint64_t most = 0xffffffff;

template <class Visitor, class Totals>
void visit_totals(Visitor& visitor, Totals& totals) {
  visitor.count(totals.topology, UINT64_MAX);
  visitor.list(totals.arrays, [&](auto& bytes) { visitor.count(bytes, UINT64_MAX); });
  visitor.count(totals.other, UINT64_MAX);
}

template <class Visitor, class Directory>
void visit(Visitor& visitor, Directory& directory) {
  visitor.count(directory.groups, most);
  visitor.count(directory.levels, 255);
  visitor.list(directory.faces, [&](auto& faces) { visitor.count(faces, UINT64_MAX); });
  visitor.list(directory.charts, [&](auto& charts) { visitor.count(charts, most); });
  for (unsigned k = 0; k < 3; ++k) visitor.real(directory.frame.low[k]);
  visitor.real(directory.frame.size);
  visit_totals(visitor, directory.finest);
  visit_totals(visitor, directory.coarser);
  // Of fixed size: the places depend on the size of what stands before.
  visitor.list(directory.index_pages, [&](auto& page) {
    visitor.fixed(page.offset);
    visitor.fixed(page.size);
  });
}

template <class Visitor, class Error>
/// Errors are floats in the file, rounded up by the writer. A reader gets the rounded number, an encoder
/// keeps its own.
void visit_error(Visitor& visitor, Error& error) {
  float rounded = float_not_less(error);
  visitor.fixed(rounded);
  if constexpr (!std::is_const_v<Error>) error = static_cast<double>(rounded);
}

template <class Visitor, class Head>
void visit_head(Visitor& visitor, Head& head) {
  visitor.count(head.level, 255);
  visitor.count(head.replaces, most);
  visit_error(visitor, head.view_error);
  visit_error(visitor, head.bound);
  visitor.list(head.charts, [&](auto& chart) {
    // None is 0, as for most charts.
    uint32_t next_producer = chart.producer + 1;
    visitor.count(next_producer, most);
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(chart)>>)
      chart.producer = next_producer - 1;
    visitor.count(chart.faces, most);
    visitor.count(chart.bytes, most);
  });
}

/// What readers rely on without asking again: a frame that numbers can be scaled by, a root group, counts for
/// each level, and a page for every 256 groups.
bool is_sensible(const ChartDirectory& directory) {
  bool finite = std::isfinite(directory.frame.size) && directory.frame.size > 0;
  for (unsigned k = 0; k < 3; ++k) finite = finite && std::isfinite(directory.frame.low[k]);
  return finite && directory.groups > 0 && directory.levels > 0 &&
         directory.levels == directory.faces.size() && directory.levels == directory.charts.size() &&
         !directory.finest.arrays.empty() &&
         directory.index_pages.size() == (directory.groups - 1) / groups_per_index_page + 1;
}

}  // namespace

std::vector<std::byte> encode_directory(const ChartDirectory& directory) {
  PlainWriter writer;
  visit(writer, directory);
  return writer.out().take();
}

Result<ChartDirectory> decode_directory(Bytes bytes, const Limits& limits) {
  PlainReader reader(bytes, plain_memory(limits));
  ChartDirectory directory;
  visit(reader, directory);
  if (reader.is_over())
    return failure(ErrorCode::memory_bound, "the directory of charts takes more memory than allowed");
  if (!reader.ok() || !reader.at_end() || !is_sensible(directory)) {
    return failure(ErrorCode::corrupt, "the directory of charts is damaged");
  }
  return directory;
}

std::vector<std::byte> encode_page_head(const PageHead& head) {
  PlainWriter writer;
  visit_head(writer, head);
  return writer.out().take();
}

Result<ParsedPageHead> decode_page_head(Bytes page) {
  // A chart takes three bytes or more here, and 12 in memory, three times as much while the list grows.
  PlainReader reader(page, 16 * page.size());
  ParsedPageHead parsed;
  visit_head(reader, parsed.head);
  if (!reader.ok()) return failure(ErrorCode::corrupt, "the head of a page of charts is damaged");
  parsed.bytes = page.size() - reader.remaining();
  return parsed;
}

}  // namespace maille
