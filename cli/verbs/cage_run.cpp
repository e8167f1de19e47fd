// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/cage_run.h"

#include "subvol/fit/mesh_check.h"

#include <variant>

namespace subvol::cli {

void CageRun::write_results(const VolumeMesh& cage, const VolumeMesh& mesh, std::span<const FitState> states,
                            const WritingOptions& writing) {
  if (cage.num_cells() > 0) return write_cage(cage, mesh, states, writing);
  write_each([&](const Output& output) {
    if (output.part == Part::animation)
      write_animation(output, mesh, mesh, states, writing);
    else
      write_output(output, mesh, writing);
  });
}

void CageRun::write_cage(const VolumeMesh& cage, const VolumeMesh& mesh, std::span<const FitState> states,
                         const WritingOptions& writing) {
  const auto write = [&](bool with_limit) {
    write_each(
        [&](const Output& output) {
          if (output.part == Part::animation)
            write_animation(output, cage, mesh, states, writing);
          else
            write_output(output, cage, mesh, &limit_.surface, writing);
        },
        [&](const Output& output) { return shows_surface(output) == with_limit; });
  };
  write(false);  // written first: if memory is short, it is the limit surface that may not fit
  limit_.surface = watched([&](auto progress) { return tessellated_limit(cage, writing, progress); });
  write(true);
}

void CageRun::measure_limit(const VolumeMesh& cage, const Target& target, const WritingOptions& writing) {
  WritingOptions fine;
  fine.chord_percent = measured_chord_percent(writing);
  if (fine.chord_percent < writing.chord_percent)
    limit_.surface = watched([&](auto progress) { return tessellated_limit(cage, fine, progress); });
  limit_.distance =
      std::visit([&](const auto& t) { return surface_distance(triangles_of(limit_.surface), t); }, target);
}

}  // namespace subvol::cli
