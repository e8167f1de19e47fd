// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/checkpoint.h"

#include "subvol/base/error.h"
#include "subvol/base/fingerprint.h"
#include "subvol/base/text_scanner.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

namespace subvol::internal {

namespace {

constexpr std::string_view kFormat = "subvol checkpoint 3\n";
constexpr std::size_t kFingerprintDigits = 16, kStepNumbers = 5;

class Writer {
 public:
  void number(std::uint64_t value) { raw(&value, sizeof value); }
  void text(std::string_view text) {
    number(text.size());
    raw(text.data(), text.size());
  }
  void numbers(std::span<const double> values) {
    number(values.size());
    raw(values.data(), values.size_bytes());
  }
  void indices(std::span<const Index> values) {
    number(values.size());
    raw(values.data(), values.size_bytes());
  }
  std::string bytes;

 private:
  void raw(const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); }
};

/// Reads what the writer wrote; throws InputError for content that cannot be valid.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  std::uint64_t number() {
    std::uint64_t value = 0;
    std::memcpy(&value, take(1, sizeof value).data(), sizeof value);
    return value;
  }
  std::string text() { return std::string(take(number(), 1)); }
  /// Reads finite numbers, whose count must be a multiple of `group`.
  std::vector<double> numbers(std::size_t group) {
    const std::string_view raw = take(number(), sizeof(double));
    std::vector<double> values(raw.size() / sizeof(double));
    if (!values.empty()) std::memcpy(values.data(), raw.data(), raw.size());
    if (values.size() % group != 0) throw InputError("numbers are missing");
    if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); }))
      throw InputError("a number is not finite");
    return values;
  }
  std::vector<Index> indices() {
    const std::string_view raw = take(number(), sizeof(Index));
    std::vector<Index> values(raw.size() / sizeof(Index));
    if (!values.empty()) std::memcpy(values.data(), raw.data(), raw.size());
    return values;
  }
  bool at_end() const { return bytes_.empty(); }

 private:
  std::string_view take(std::uint64_t count, std::size_t size) {
    if (count > bytes_.size() / size) throw InputError("it ends too early");
    const std::string_view taken = bytes_.substr(0, count * size);
    bytes_.remove_prefix(taken.size());
    return taken;
  }

  std::string_view bytes_;
};

void write_stage(const SolvedStage& stage, Writer& writer) {
  const auto flat = [](std::span<const Vec3> points) {
    std::vector<double> numbers;
    for (const Vec3& p : points) numbers.insert(numbers.end(), {p.x(), p.y(), p.z()});
    return numbers;
  };
  std::vector<double> steps;
  for (const IterationRecord& step : stage.result.iterations)
    steps.insert(steps.end(), {step.surface_energy, step.volume_energy, step.step_length,
                               static_cast<double>(step.linear_iterations), static_cast<double>(step.evaluations)});
  writer.text(stage.name);
  writer.number(stage.start);
  writer.number(static_cast<std::uint64_t>(stage.result.stop));
  writer.text(stage.result.explanation);
  writer.numbers(std::span(&stage.seconds, 1));
  writer.numbers(steps);
  writer.numbers(flat(stage.x));
  writer.number(static_cast<std::uint64_t>(stage.result.small_steps));
  writer.number(stage.result.densified.size());
  for (const std::vector<Index>& cells : stage.result.densified) writer.indices(cells);
  writer.numbers(flat(stage.result.densified_at));
}

MinimizerStop stop_of(std::uint64_t number) {
  for (const MinimizerStop stop : {MinimizerStop::converged, MinimizerStop::iteration_limit, MinimizerStop::no_step,
                                   MinimizerStop::cancelled, MinimizerStop::infeasible_start})
    if (number == static_cast<std::uint64_t>(stop)) return stop;
  throw InputError("a minimization ends in no known way");
}

int count_of(double number) {
  if (!(number >= 0 && number <= 1e9 && number == std::floor(number))) throw InputError("a count is out of range");
  return static_cast<int>(number);
}

SolvedStage read_stage(Reader& reader) {
  SolvedStage stage;
  stage.name = reader.text();
  stage.start = reader.number();
  stage.result.stop = stop_of(reader.number());
  stage.result.explanation = reader.text();
  const std::vector<double> seconds = reader.numbers(1);
  if (seconds.size() != 1 || seconds[0] < 0) throw InputError("a time is out of range");
  stage.seconds = seconds[0];
  const auto points = [&reader] {
    const std::vector<double> numbers = reader.numbers(3);
    std::vector<Vec3> result;
    for (std::size_t i = 0; i < numbers.size(); i += 3) result.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    return result;
  };
  const std::vector<double> steps = reader.numbers(kStepNumbers);
  stage.x = points();
  for (std::size_t i = 0; i < steps.size(); i += kStepNumbers)
    stage.result.iterations.push_back(
        {steps[i], steps[i + 1], steps[i + 2], count_of(steps[i + 3]), count_of(steps[i + 4])});
  stage.result.small_steps = count_of(static_cast<double>(reader.number()));
  for (std::uint64_t left = reader.number(); left > 0; --left) stage.result.densified.push_back(reader.indices());
  stage.result.densified_at = points();
  return stage;
}

Checkpoint read_content(std::string_view content) {
  Reader reader(content);
  Checkpoint checkpoint;
  for (std::uint64_t left = reader.number(); left > 0; --left) {
    std::string key = reader.text(), value = reader.text();
    checkpoint.identity.emplace_back(std::move(key), std::move(value));
  }
  for (std::uint64_t left = reader.number(); left > 0; --left) {
    checkpoint.stages.push_back(read_stage(reader));
    if (left > 1 && !checkpoint.stages.back().is_over())
      throw InputError("a minimization that is not over is followed by one");
  }
  if (!reader.at_end()) throw InputError("something follows its end");
  return checkpoint;
}

}  // namespace

std::string checkpoint_bytes(const RunIdentity& identity, const std::vector<SolvedStage>& stages) {
  Writer writer;
  writer.number(identity.size());
  for (const auto& [key, value] : identity) {
    writer.text(key);
    writer.text(value);
  }
  writer.number(stages.size());
  for (const SolvedStage& stage : stages) write_stage(stage, writer);
  return std::string(kFormat) + Fingerprint().add(writer.bytes).text() + '\n' + writer.bytes;
}

Checkpoint parse_checkpoint(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(kFormat)) throw InputError(name + ": is no checkpoint of this version of subvol");
  bytes.remove_prefix(kFormat.size());
  const std::string_view digits = bytes.substr(0, kFingerprintDigits);
  bytes.remove_prefix(std::min(bytes.size(), kFingerprintDigits + 1));
  if (digits != Fingerprint().add(bytes).text())
    throw InputError(name + ": this checkpoint was cut off or changed: its fingerprint is not that of its content");
  try {
    return read_content(bytes);
  } catch (const InputError& error) {
    throw InputError(name + ": this checkpoint holds what no run writes: " + error.what());
  }
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
  return parse_checkpoint(read_file(path), path.string());
}

void require_same_run(const RunIdentity& checkpoint, const RunIdentity& run, const std::string& name) {
  std::map<std::string, std::pair<std::string, std::string>> values;
  for (const auto& [key, value] : checkpoint) values[key].first = value;
  for (const auto& [key, value] : run) values[key].second = value;
  std::string differences;
  for (const auto& [key, pair] : values) {
    const auto& [then, now] = pair;
    if (then == now) continue;
    const auto shown = [](const std::string& value) { return value.empty() ? "not given" : value; };
    differences += (differences.empty() ? "" : "; ") + key + " was " + shown(then) + ", is " + shown(now);
  }
  if (!differences.empty()) throw InputError(name + ": this checkpoint is of another run: " + differences);
}

}  // namespace subvol::internal
