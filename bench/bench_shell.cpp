// SPDX-License-Identifier: GPL-3.0-or-later
// Shells of finer and finer bowls: cells per second, and the share that checks take of the time.

#include "samples/shapes.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/shell/shell.h"

#include <omp.h>

#include <chrono>
#include <cstdio>
#include <string>

using namespace subvol;

namespace {

double seconds_of(const FitReport& report, const std::string& part) {
  for (const auto& [name, seconds] : report.seconds)
    if (name == part) return seconds;
  return 0;
}

}  // namespace

int main() {
  std::printf("{\"threads\": %d, \"shells\": [", omp_get_max_threads());
  const char* separator = "";
  for (const int n : {16, 32, 64, 128, 200}) {
    const PolygonMesh surface = samples::bowl_surface(n);
    const auto start = std::chrono::steady_clock::now();
    const ShellResult shell = make_shell(surface, {.thickness = 0.05, .side = ShellSide::both, .layers = 2});
    const double total = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf(
        "%s\n  {\"faces\": %zu, \"cells\": %zu, \"valid\": %s, \"seconds\": %.3f, \"cells_per_second\": %.0f, "
        "\"start_share\": %.3f, \"solve_share\": %.3f, \"check_share\": %.3f}",
        separator, surface.num_faces(), shell.mesh.num_cells(), shell.failures.none() ? "true" : "false", total,
        static_cast<double>(shell.mesh.num_cells()) / total,
        (seconds_of(shell.report, "directions") + seconds_of(shell.report, "thickness") +
         seconds_of(shell.report, "start")) /
            total,
        seconds_of(shell.report, "solve") / total, seconds_of(shell.report, "check") / total);
    separator = ",";
  }
  std::printf("\n]}\n");
}
