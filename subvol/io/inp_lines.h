// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/io/file_place.h"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

/// A part in its place in the assembly: x -> rotation x + shift. Numbers of nodes and elements are its own.
struct InpInstance {
  std::string name;        ///< empty: the only one
  std::int64_t first = 0;  ///< to be added to numbers of nodes and elements, to tell instances apart
  Mat3 rotation = Mat3::Identity();
  Vec3 shift = Vec3::Zero();
};

/// Numbers of nodes and elements are below it; `InpInstance::first` is a multiple of it.
inline constexpr std::int64_t kInpNumbers = std::int64_t{1} << 40;

/// One line of an Abaqus or CalculiX file.
struct InpLine {
  std::string keyword;                            ///< in upper case; for data that of the last keyword
  std::map<std::string, std::string> parameters;  ///< of the keyword, by name in upper case
  std::vector<std::string> fields;                ///< of data, between commas; empty for a keyword
  FilePlace place;
  const InpInstance* instance = nullptr;  ///< null: none; what stands in the assembly or outside parts
  bool is_data() const { return !fields.empty(); }
  bool has(const char* name) const { return parameters.contains(name); }
  std::string parameter(const char* name) const;
};

/// The lines of a file and of those that it includes, in the order in which they count: those of a part come at each of
/// its instances. Without instances, parts are taken where they are, one after the other.
class InpLines {
 public:
  /// name  path of the file: included ones are found beside it.
  InpLines(const std::string& name, std::string_view bytes);

  /// Calls visit(line) for each line but comments and those that say where parts, instances and included files begin
  /// and end. InputError, with file and line: an included file that cannot be read or too many of them, an instance of
  /// an unknown part, a transformation that is none, a part in a part.
  void visit(const std::function<void(const InpLine&)>& visit);

  /// Returns the instance of this name, or null. Valid after the lines before its use were visited.
  const InpInstance* instance(const std::string& name) const;
  std::size_t num_instances() const { return instances_.size(); }
  /// Returns true if a part or an instance has begun.
  bool has_parts() const { return !parts_.empty(); }
  std::size_t unused_parts() const { return unused_parts_; }
  /// The last line of the file, for messages at its end.
  const FilePlace& place() const { return line_.place; }

 private:
  struct RawLine {
    std::string text;
    FilePlace place;
  };
  struct Part {
    std::string name;
    std::vector<RawLine> lines;
    bool is_used = false;
  };

  void read_file_of(const std::string& file, std::string_view bytes, int depth);
  void take(RawLine raw, int depth);
  void take_keyword(const RawLine& raw, int depth);
  void take_data(const RawLine& raw);
  void open_instance();
  void close_instance();
  void add_transformation();
  void replay(Part& part, const InpInstance& instance);
  void replay_parts_in_place();
  void include(int depth);

  std::string name_;
  std::string_view bytes_;
  std::function<void(const InpLine&)> visit_;
  IncludedFiles included_;
  std::deque<std::string> files_;  ///< names, for the places of lines
  std::deque<Part> parts_;
  std::deque<InpInstance> instances_;
  std::map<std::string, std::size_t> part_numbers_, instance_numbers_;  ///< by name in upper case
  InpLine line_;
  Part* recorded_ = nullptr;             ///< the part whose lines are being read
  Part* pending_ = nullptr;              ///< the part of the instance whose transformation is being read
  std::size_t num_transformations_ = 0;  ///< lines of that instance
  std::size_t unused_parts_ = 0, num_replayed_ = 0;
  bool is_replaying_ = false;
};

}  // namespace subvol::internal
