// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/inp_lines.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/mesh_formats.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <numbers>
#include <utility>

namespace subvol::internal {

namespace {

/// The fields between commas, without blanks around them; an empty last field is dropped.
std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields;
  std::size_t at = 0;
  while (at <= line.size()) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    fields.push_back(trimmed(line.substr(at, end - at)));
    at = end + 1;
  }
  if (fields.size() > 1 && fields.back().empty()) fields.pop_back();
  return fields;
}

}  // namespace

std::string InpLine::parameter(const char* name) const {
  const auto found = parameters.find(name);
  return found == parameters.end() ? "" : found->second;
}

InpLines::InpLines(const std::string& name, std::string_view bytes) : name_(name), bytes_(bytes), included_(name) {}

void InpLines::visit(const std::function<void(const InpLine&)>& visit) {
  visit_ = visit;
  read_file_of(name_, bytes_, 0);
  if (pending_) close_instance();
  if (recorded_) fail_at(line_.place, "*PART: expected *END PART");
  if (instances_.empty()) replay_parts_in_place();
  for (const Part& part : parts_) unused_parts_ += !part.is_used;
}

const InpInstance* InpLines::instance(const std::string& name) const {
  const auto found = instance_numbers_.find(upper_case(name));
  return found == instance_numbers_.end() ? nullptr : &instances_[found->second];
}

void InpLines::read_file_of(const std::string& file, std::string_view bytes, int depth) {
  files_.push_back(file);
  const std::string* name = &files_.back();
  TextScanner lines(file, bytes, TextScanner::Comments::none);
  while (const auto line = lines.line()) {
    RawLine raw{trimmed(*line), {name, lines.word_line()}};
    line_.place = raw.place;
    if (!raw.text.empty() && !raw.text.starts_with("**")) take(std::move(raw), depth);
  }
}

void InpLines::take(RawLine raw, int depth) {
  if (raw.text.starts_with("*"))
    take_keyword(raw, depth);
  else if (recorded_)
    recorded_->lines.push_back(std::move(raw));
  else
    take_data(raw);
}

/// Splits "*KEYWORD, NAME=VALUE, NAME".
void InpLines::take_keyword(const RawLine& raw, int depth) {
  line_.place = raw.place;
  line_.parameters.clear();
  line_.fields.clear();
  const std::vector<std::string> fields = fields_of(std::string_view(raw.text).substr(1));
  line_.keyword = upper_case(fields[0]);
  for (std::size_t i = 1; i < fields.size(); ++i) {
    const std::size_t equals = fields[i].find('=');
    std::string value = equals == std::string::npos ? "" : trimmed(std::string_view(fields[i]).substr(equals + 1));
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
    line_.parameters[upper_case(trimmed(std::string_view(fields[i]).substr(0, equals)))] = value;
  }
  if (pending_) {
    // The part is replayed before this keyword, which then is the last one again.
    InpLine next = line_;
    close_instance();
    const InpInstance* instance = line_.instance;
    line_ = std::move(next);
    line_.instance = instance;
  }
  const std::string& keyword = line_.keyword;
  if (keyword == "INCLUDE") return include(depth);
  if (keyword == "END PART") {
    recorded_ = nullptr;
  } else if (keyword == "PART") {
    if (recorded_ || is_replaying_) fail_at(raw.place, "*PART: a part within a part");
    const std::string name = line_.parameter("NAME");
    if (!part_numbers_.try_emplace(upper_case(name), parts_.size()).second)
      fail_at(raw.place, "a second *PART " + in_quotes(name));
    recorded_ = &parts_.emplace_back(Part{name, {}});
  } else if (recorded_) {
    recorded_->lines.push_back(raw);
  } else if (keyword == "INSTANCE") {
    open_instance();
  } else if (keyword == "END INSTANCE") {
    line_.instance = nullptr;
  } else if (keyword != "HEADING" && keyword != "ASSEMBLY" && !keyword.starts_with("END")) {
    visit_(line_);
  }
}

void InpLines::take_data(const RawLine& raw) {
  line_.place = raw.place;
  line_.fields = fields_of(raw.text);
  if (pending_)
    add_transformation();
  else if (line_.keyword != "HEADING")
    visit_(line_);
}

void InpLines::open_instance() {
  const std::string part = line_.parameter("PART"), name = line_.parameter("NAME");
  if (is_replaying_) fail_at(line_.place, "*INSTANCE: within a part");
  const auto found = part_numbers_.find(upper_case(part));
  if (found == part_numbers_.end()) fail_at(line_.place, "*INSTANCE: there is no part " + in_quotes(part));
  if (!instance_numbers_.try_emplace(upper_case(name), instances_.size()).second)
    fail_at(line_.place, "a second *INSTANCE " + in_quotes(name));
  constexpr std::size_t kMostInstances = 1u << 16;
  if (instances_.size() >= kMostInstances) fail_at(line_.place, "*INSTANCE: too many instances");
  const auto first = static_cast<std::int64_t>(instances_.size()) * kInpNumbers;
  instances_.push_back({.name = name, .first = first});
  pending_ = &parts_[found->second];
  num_transformations_ = 0;
}

/// Takes a line with a translation, or, after it, with two points of an axis and an angle in degrees.
void InpLines::add_transformation() {
  std::vector<double> numbers;
  for (const std::string& field : line_.fields) {
    const auto value = parse_number(field.empty() ? "0" : field);
    if (!value) fail_at(line_.place, "*INSTANCE: expected a number, found " + in_quotes(field));
    numbers.push_back(*value);
  }
  InpInstance& instance = instances_.back();
  if (++num_transformations_ == 1 && numbers.size() <= 3) {
    for (std::size_t k = 0; k < numbers.size(); ++k) instance.shift[static_cast<Eigen::Index>(k)] = numbers[k];
    return;
  }
  if (num_transformations_ > 2 || numbers.size() != 7)
    fail_at(line_.place, "*INSTANCE: expected a translation and then two points of an axis and an angle");
  const Vec3 a(numbers[0], numbers[1], numbers[2]), b(numbers[3], numbers[4], numbers[5]);
  const double length = (b - a).norm();
  if (!(length > 0)) fail_at(line_.place, "*INSTANCE: the two points of the axis are one");
  const Mat3 turn = Eigen::AngleAxisd(numbers[6] * std::numbers::pi / 180, Vec3((b - a) / length)).toRotationMatrix();
  instance.rotation = turn;
  instance.shift = turn * (instance.shift - a) + a;  // turned after it was moved
}

void InpLines::close_instance() {
  Part& part = *std::exchange(pending_, nullptr);
  replay(part, instances_.back());
}

/// Visits the lines of a part. Further lines up to *END INSTANCE belong to the instance as well.
void InpLines::replay(Part& part, const InpInstance& instance) {
  constexpr std::size_t kMostLines = std::size_t{1} << 26;  // a few instances of a large part stand for many lines
  num_replayed_ += part.lines.size();
  if (num_replayed_ > kMostLines) fail_at(line_.place, "*INSTANCE: instances of more than 67 million lines in all");
  part.is_used = true;
  is_replaying_ = true;
  line_.instance = &instance;
  line_.keyword.clear();  // data before the first keyword of the part do not belong to the one that closed the instance
  for (const RawLine& raw : part.lines) {
    if (raw.text.starts_with("*"))
      take_keyword(raw, 0);
    else
      take_data(raw);
  }
  is_replaying_ = false;
}

void InpLines::replay_parts_in_place() {
  const bool is_only = parts_.size() == 1;
  for (Part& part : parts_) {
    const auto first = static_cast<std::int64_t>(instances_.size()) * kInpNumbers;
    instance_numbers_.try_emplace(upper_case(part.name), instances_.size());
    instances_.push_back({.name = is_only ? "" : part.name, .first = first});
    replay(part, instances_.back());
  }
}

void InpLines::include(int depth) {
  const std::string input = line_.parameter("INPUT");
  if (input.empty()) fail_at(line_.place, "*INCLUDE: expected INPUT=FILE");
  const IncludedFiles::File file = included_.read(line_.place, input, depth + 1);
  line_.keyword.clear();
  read_file_of(file.name, file.bytes, depth + 1);
}

}  // namespace subvol::internal
