#pragma once

#include <maille/folder.h>
#include <maille/mesh.h>

#include <string>

#include "io/buffered_writer.h"

namespace maille {

/// Writes OpenFOAM's files: a header each, then lists, as text or in binary, little-endian, as the header
/// says.
class FoamWriter {
 public:
  /// `single`: floating point numbers have 32 bits, which only binary files tell.
  FoamWriter(FolderSink& sink, bool binary, bool single)
      : sink_(sink), out_(sink), binary_(binary), single_(single) {}

  bool binary() const { return binary_; }
  /// What has no form of its own here.
  BufferedWriter& out() { return out_; }
  /// Labels beyond 2^31 take 64 bits. Call this before the first file: all files have one width.
  void set_wide_labels(bool wide) { wide_labels_ = wide; }

  /// `kind`: OpenFOAM's class; `note`: of the header, if not empty.
  Result<> begin(const std::string& name, const std::string& kind, const std::string& note = "");
  Result<> end();
  void begin_list(uint64_t count);
  void end_list() { out_.put(")\n"); }
  /// One entry of a list; in text, a line.
  void put_label(uint64_t label);
  void put_flag(bool flag);

 private:
  FolderSink& sink_;
  BufferedWriter out_;
  bool binary_, single_;
  bool wide_labels_ = false;
};

}  // namespace maille
