// SPDX-License-Identifier: GPL-3.0-or-later
// Bad files are refused by every verb.

#include "subvol/export/high_order_file.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <sys/resource.h>

namespace fs = std::filesystem;
using subvol::test::content_of;
using subvol::test::kSanitized;
using subvol::test::Run;
using subvol::test::Workplace;

TEST_CASE("Bad files are refused by every verb, and without a trace", "[cli][data][slow]") {
  const auto data = subvol::test::require_data();
  if (!data) return;
  const Workplace place;
  std::istringstream list(content_of(*data / "bad" / "EXPECT.txt"));
  for (std::string line; std::getline(list, line);) {
    if (line.empty() || line[0] == '#') continue;
    const std::string name = line.substr(0, line.find('\t'));
    const bool must_refuse = line.substr(name.size() + 1).starts_with("reject\t");
    const std::string path = (*data / "bad" / name).string();
    const bool volume = name.ends_with(".mesh");
    const std::vector<std::string> commands =
        volume ? std::vector<std::string>{"fit target.off --levels 1 --template " + path + " -o out.mesh",
                                          "fit " + path + " --levels 1 --template template.mesh -o out.mesh",
                                          "optimize " + path + " --max-iterations 2 -o out.mesh",
                                          "shell " + path + " --thickness 1% -o out.mesh",
                                          "subdivide " + path + " --levels 1 -o out.mesh",
                                          "template split " + path + " --into tets -o out.mesh",
                                          "template carve " + path + " --list 0 -o out.mesh",
                                          "template pillow " + path + " -o out.mesh",
                                          "template refine " + path + " --list 0 -o out.mesh",
                                          "template merge " + path + " -o out.mesh",
                                          "template collapse " + path + " --vertices 0 1 -o out.mesh",
                                          "optimize " + path + " --order 2 --target target.off -o out.vtk",
                                          "check " + path,
                                          "convert " + path + " -o out.vtk"}
               : std::vector<std::string>{"fit " + path + " --levels 1 --template template.mesh -o out.mesh",
                                          "fit " + path + " --levels 1 -o out.mesh",
                                          "optimize template.mesh --max-iterations 2 --target " + path + " -o out.mesh",
                                          "shell " + path + " --thickness 1% -o out.mesh",
                                          "template auto " + path + " -o out.mesh",
                                          "template extrude " + path + " --thickness 0.1 -o out.mesh",
                                          "check template.mesh --target " + path,
                                          "convert " + path + " -o out.obj"};
    for (const std::string& command : commands) {
      for (const char* output : {"out.mesh", "out.vtk", "out.obj"}) fs::remove(place / output);
      const auto before = place.names();
      const Run run = place.run(command, kSanitized ? -1 : static_cast<int>(RLIMIT_DATA), rlim_t{512} << 20);
      INFO(command << '\n' << run.err);
      const bool is_check = command.starts_with("check");
      if (run.status == 0 || place.names() != before) {
        // Flat and inverted cells may pass, with words; what is written is then said not to be valid, or not converged.
        CHECK(!must_refuse);
        CHECK((run.status == 0 || ((run.status == 1 || run.status == 4) && !run.err.empty())));
      } else {
        // A readable but unsound mesh is an answer of `check`, not a refusal.
        CHECK((run.status == 3 || (is_check && volume && run.status == 1)));
        CHECK(!(run.err.empty() && run.out.empty()));
      }
    }
  }
}

TEST_CASE("No verb takes a mesh that is a point", "[cli][slow]") {
  const Workplace place;
  place.file("point.mesh",
             "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n1 2 3 0\n1 2 3 0\n1 2 3 0\n1 2 3 0\n"
             "Tetrahedra\n1\n1 2 3 4 0\nEnd\n");
  subvol::VolumeMesh straight = subvol::test::lattice(1, 1, 1);
  for (subvol::Vec3& x : straight.positions) x = {1, 2, 3};
  const subvol::HighOrderMesh mesh(subvol::ElementSpace(straight, subvol::Basis::fourier, 2), straight);
  subvol::write_volume(place / "point.vtu", mesh, {});
  for (const std::string verb :
       {"check point.mesh", "convert point.mesh -o a.vtk", "subdivide point.mesh -o a.mesh",
        "optimize point.mesh -o a.mesh", "fit target.off --template point.mesh -o a.mesh", "fit point.mesh -o a.mesh",
        "template pillow point.mesh -o a.mesh", "shell point.mesh --thickness 1 -o a.mesh",
        "check template.mesh --target point.mesh", "check point.vtu", "convert point.vtu -o a.mesh"}) {
    const Run run = place.run(verb);
    CAPTURE(verb, run.err);
    CHECK(run.status == 3);
    CHECK(run.err.find("in one place") != std::string::npos);
    CHECK(!place.has("a.mesh"));
  }
}
