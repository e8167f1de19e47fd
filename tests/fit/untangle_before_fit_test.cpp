// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/untangle_before_fit.h"
#include "subvol/fit/certificate/certificate.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <string_view>

namespace subvol::test {

TEST_CASE("a mesh is untangled before it is curved, and left alone where it is valid", "[optimize]") {
  const VolumeMesh block = lattice(2, 2, 2);
  VolumeMesh mesh = block;
  CHECK(untangle_before_fit(mesh, {}).tangled == 0);
  CHECK(mesh.positions == block.positions);
  *std::find(mesh.positions.begin(), mesh.positions.end(), Vec3(1, 1, 1)) = Vec3(2.4, 1, 1);  // beyond the boundary
  const std::size_t tangled = certify(mesh).not_certified.size();
  REQUIRE(tangled > 0);
  OptimizeOptions cancelled;
  cancelled.control.progress = [](const FitProgress&) { return false; };
  const VolumeMesh before = mesh;
  const UntangledStart ended = untangle_before_fit(mesh, cancelled);
  CHECK(ended.stop_reason == StopReason::cancelled);
  CHECK(ended.tangled == tangled);
  CHECK(ended.left > 0);
  CHECK(mesh.positions == before.positions);
  OptimizeOptions late;  // all are valid by then, but not improved
  late.control.progress = [](const FitProgress& progress) {
    return !std::string_view(progress.stage).starts_with("round 1");
  };
  const UntangledStart improving = untangle_before_fit(mesh, late);
  CHECK(improving.ended_early());
  CHECK(improving.left == 0);
  CHECK(mesh.positions == before.positions);
  const UntangledStart done = untangle_before_fit(mesh, {});
  CHECK(done.tangled == tangled);
  CHECK(done.left == 0);
  CHECK_FALSE(done.ended_early());
  CHECK(certify(mesh).all_certified());
}

}  // namespace subvol::test
