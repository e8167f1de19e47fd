// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/checkpointing.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/fingerprint.h"
#include "subvol/base/version.h"

#include <new>
#include <set>
#include <string_view>

namespace subvol::cli {

using namespace internal;
namespace {

/// Options that do not affect the fit's result, and names of inputs, which are identified by their content.
const std::set<std::string, std::less<>> kNeutralOptions{"chord",  "unit",     "up",           "cut",     "seed",
                                                         "target", "template", "no-wireframe", "quantize"};

std::span<const double> numbers(const std::vector<Vec3>& points) {
  return {points.empty() ? nullptr : points.front().data(), 3 * points.size()};
}

StageLog earlier_log(const std::string& file, const RunIdentity& identity) {
  if (file.empty()) return {};
  Checkpoint checkpoint = read_checkpoint(file);
  require_same_run(checkpoint.identity, identity, file);
  return {std::move(checkpoint.stages), file};
}

}  // namespace

std::string fingerprint(const TriangleMesh& mesh) {
  Fingerprint print;
  print.add(numbers(mesh.positions)).add(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) print.add(std::span<const Index>(triangle));
  return print.text();
}

std::string fingerprint(const PointCloud& cloud) { return Fingerprint().add(numbers(cloud.points)).text(); }

std::string fingerprint(const Target& target) {
  return std::visit([](const auto& surface) { return fingerprint(surface); }, target);
}

std::string fingerprint(const VolumeMesh& mesh) {
  Fingerprint print;
  print.add(numbers(mesh.positions)).add(std::span(mesh.kinds)).add(std::span(mesh.cell_vertices));
  print.add(std::span(mesh.references));
  for (const CreaseEdge& crease : mesh.tags.creases) print.add(crease.v0).add(crease.v1).add(crease.sharpness);
  for (const CornerVertex& corner : mesh.tags.corners) print.add(corner.vertex).add(corner.sharpness);
  return print.text();
}

RunIdentity run_identity(const std::string& verb, const Json& options,
                         const std::vector<std::pair<std::string, std::string>>& inputs) {
  RunIdentity identity{{"version", version()}, {"verb", verb}};
  identity.insert(identity.end(), inputs.begin(), inputs.end());
  for (const auto& [name, value] : options.items())
    if (!kNeutralOptions.contains(name))
      identity.emplace_back("--" + name, value.dump(-1, ' ', false, Json::error_handler_t::replace));
  return identity;
}

void require_resumable(const RunOptions& run, const RunIdentity& identity_but_template) {
  if (run.resume.empty()) return;
  RunIdentity earlier = read_checkpoint(run.resume).identity;
  std::erase_if(earlier, [](const auto& entry) { return entry.first == "template"; });
  require_same_run(earlier, identity_but_template, run.resume);
}

Checkpointing::Checkpointing(const RunOptions& run, RunIdentity identity)
    : run_(run), identity_(std::move(identity)), log_(earlier_log(run.resume, identity_)) {
  if (run_.checkpoint.empty()) return;
  log_.on_add = [this] {
    is_written_ = false;
    if (std::chrono::duration<double>(Clock::now() - written_).count() >= run_.every_seconds) write();
  };
}

void Checkpointing::write() {
  try {
    write_file_atomically(run_.checkpoint, checkpoint_bytes(identity_, log_.stages()));
    failure_.clear();
    is_written_ = true;
  } catch (const IoError& error) {
    failure_ = error.what();
  } catch (const std::bad_alloc&) {
    failure_ = run_.checkpoint + ": no memory was left for it";
  }
  written_ = Clock::now();
}

void Checkpointing::finish(std::vector<std::string>& warnings) {
  if (run_.checkpoint.empty()) return;
  if (!is_written_ || (log_.num_recalled() > 0 && run_.checkpoint != run_.resume)) write();
  if (!failure_.empty()) warnings.push_back("the checkpoint is not up to date: " + failure_);
}

void Checkpointing::describe(Json& report) const {
  if (run_.resume.empty()) return;
  report["resumed_from"] = run_.resume;
  report["recalled_stages"] = log_.num_recalled();
}

}  // namespace subvol::cli
