// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/record.h"

#include "subvol/base/error.h"

#include <cmath>
#include <ctime>
#include <string>
#include <utility>

#include <unistd.h>

namespace subvol::cli {
namespace {

/// Entries of a report that a record repeats: the path in the report, and the name in the record.
struct ReportFigure {
  const char *part, *entry, *name;
};
constexpr ReportFigure kReportFigures[] = {
    {"quality", "cells", "cells"},
    {"quality", "min_scaled_jacobian", "min_scaled_jacobian"},
    {"quality", "mean_scaled_jacobian", "mean_scaled_jacobian"},
    {"quality", "certified_cells", "certified_cells"},
    {nullptr, "boundary_self_intersections", "boundary_self_intersections"},
    {"distance", "mean_percent", "mean_distance_percent"},
    {"distance", "max_percent", "max_distance_percent"},
    {"creases", "target_curves", "sharp_edges"},
    {"creases", "followed_curves", "followed_edges"},
    {nullptr, "stop_reason", "stop_reason"},
    {nullptr, "fillable", "fillable"},
    {nullptr, "num_parts", "num_parts"},
};

constexpr std::string_view kBeginning = "{\"id\":\"";

const Json* find(const Json& report, const ReportFigure& figure) {
  const Json* part = &report;
  if (figure.part != nullptr) {
    if (!report.contains(figure.part) || !report[figure.part].is_object()) return nullptr;
    part = &report[figure.part];
  }
  return part->contains(figure.entry) && (*part)[figure.entry].is_primitive() ? &(*part)[figure.entry] : nullptr;
}

std::string utc(double seconds) {
  const auto time = static_cast<std::time_t>(seconds);
  std::tm parts{};
  gmtime_r(&time, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string host() {
  char name[256] = {};
  return gethostname(name, sizeof name - 1) == 0 ? as_utf8(name) : std::string();
}

double rounded_milliseconds(double seconds) { return std::round(1000 * seconds) / 1000; }

/// Receives the entries of a record from the parser, without making a tree of it.
class FieldsHandler : public nlohmann::json_sax<Json> {
 public:
  explicit FieldsHandler(RecordFields& fields) : fields_(fields) {}

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t value) override { return set(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return set(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return set(value); }
  bool string(string_t& value) override {
    if (std::string* text = text_at()) *text = std::move(value);
    return true;
  }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return ++depth_, is_run_ = depth_ == 2 && key_ == "run", true; }
  bool end_object() override { return --depth_, is_run_ = false, true; }
  bool start_array(std::size_t) override { return ++depth_, true; }
  bool end_array() override { return --depth_, true; }
  bool key(string_t& value) override { return key_.swap(value), true; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  bool set(double value) {
    if (double* number = number_at()) *number = value;
    return true;
  }
  std::string* text_at() {
    if (is_run_) return key_ == "input_stamp" ? &fields_.input_stamp : nullptr;
    if (depth_ != 1) return nullptr;
    const std::pair<const char*, std::string*> all[] = {{"id", &fields_.id},
                                                        {"class", &fields_.outcome},
                                                        {"reason", &fields_.reason},
                                                        {"verb", &fields_.verb},
                                                        {"input", &fields_.input},
                                                        {"options_hash", &fields_.key.options_hash},
                                                        {"version", &fields_.key.version},
                                                        {"input_hash", &fields_.key.input_hash}};
    for (const auto& [name, text] : all)
      if (key_ == name) return text;
    return nullptr;
  }
  double* number_at() {
    if (depth_ != 1 && !is_run_) return nullptr;
    const std::pair<const char*, double*> of_work[] = {{"cells", &fields_.cells},
                                                       {"min_scaled_jacobian", &fields_.min_scaled_jacobian},
                                                       {"mean_scaled_jacobian", &fields_.mean_scaled_jacobian},
                                                       {"mean_distance_percent", &fields_.mean_distance_percent},
                                                       {"max_distance_percent", &fields_.max_distance_percent},
                                                       {"sharp_edges", &fields_.sharp_edges},
                                                       {"followed_edges", &fields_.followed_edges}};
    const std::pair<const char*, double*> of_run[] = {{"wall_seconds", &fields_.wall_seconds},
                                                      {"cpu_seconds", &fields_.cpu_seconds},
                                                      {"peak_memory_bytes", &fields_.peak_memory_bytes}};
    if (is_run_) {
      for (const auto& [name, number] : of_run)
        if (key_ == name) return number;
    } else {
      for (const auto& [name, number] : of_work)
        if (key_ == name) return number;
    }
    return nullptr;
  }

  RecordFields& fields_;
  std::string key_;
  int depth_ = 0;
  bool is_run_ = false;
};

}  // namespace

std::string record_line(const BatchModel& model, const WorkKey& key, const Verdict& verdict, const ChildEnd& end,
                        const Remains& remains, const std::string& input_stamp, double started) {
  Json record{{"id", model.id},
              {"status", status_of(verdict.outcome)},
              {"class", name_of(verdict.outcome)},
              {"reason", verdict.reason},
              {"verb", model.verb},
              {"input", as_utf8(model.input)},
              {"options", Json::array()},
              {"exit_code", end.exit_code < 0 ? Json() : Json(end.exit_code)},
              {"signal", end.signal == 0 ? Json() : Json(signal_name(end.signal))}};
  for (const std::string& word : model.options) record["options"].push_back(as_utf8(word));
  double peak = static_cast<double>(end.peak_memory_bytes);
  if (const Json& report = remains.report; report.is_object()) {
    for (const ReportFigure& figure : kReportFigures)
      if (const Json* value = find(report, figure)) record[figure.name] = *value;
    if (record.contains("cells") && record.contains("certified_cells"))
      record["certified"] = record["cells"] == record["certified_cells"];
    // The system's figure includes the memory of the batch itself, as of the moment at which it started the process.
    if (const Json* own = find(report, {nullptr, "peak_memory_bytes", nullptr}); own != nullptr && own->is_number())
      peak = own->get<double>();
  }
  record["outputs"] = remains.outputs;
  record["options_hash"] = key.options_hash;
  record["input_hash"] = key.input_hash;
  record["version"] = key.version;
  static const std::string kHost = host();
  record["run"] = {{"started", utc(started)},
                   {"wall_seconds", rounded_milliseconds(end.wall_seconds)},
                   {"cpu_seconds", rounded_milliseconds(end.cpu_seconds)},
                   {"peak_memory_bytes", static_cast<std::uint64_t>(peak)},
                   {"host", kHost},
                   {"input_stamp", input_stamp}};
  return record.dump(-1, ' ', false, Json::error_handler_t::replace);
}

const RecordFields* RecordReader::read(std::string_view line) {
  fields_ = {};
  if (!line.starts_with(kBeginning)) return nullptr;
  FieldsHandler handler(fields_);
  if (!Json::sax_parse(line, &handler) || fields_.id.empty() || !outcome_named(fields_.outcome)) return nullptr;
  return &fields_;
}

std::string_view quoted_id(std::string_view line) {
  if (!line.starts_with(kBeginning)) return {};
  line.remove_prefix(kBeginning.size());
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') return line.substr(0, i);
    if (line[i] == '\\') ++i;
  }
  return {};
}

std::string without_run(std::string_view line) {
  Json record = Json::parse(line, nullptr, false);
  if (!record.is_object()) throw InputError("expected a record in JSON");
  record.erase("run");
  return record.dump();
}

}  // namespace subvol::cli
