// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/hex_contraction.h"

#include "tests/support/bent_hex.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

HexPart random_part(std::mt19937& random, const HexContraction& contraction) {
  HexPart part;
  for (int d = 0; d < 3; ++d) {
    part.levels[d] = static_cast<int>(random() % 6);
    part.index[d] = static_cast<int>(random() % (1u << part.levels[d]));
    part.tiers[d] = static_cast<int>(random() % static_cast<unsigned>(contraction.num_tiers(d)));
  }
  return part;
}

}  // namespace

TEST_CASE("A hex contracted in single precision is what it is in double, less a point, up to its bounds",
          "[hex_matrices]") {
  std::mt19937 random(11);
  for (const Basis basis : {Basis::fourier, Basis::legendre})
    for (const int order : {1, 2, 3, 4, 5, 8, 12, 16}) {
      HexContraction contraction(basis, order);
      std::array<BentHex, 4> hexes;  // each stays until all are done
      for (BentHex& hex : hexes) {
        const int pattern = static_cast<int>(&hex - hexes.data());
        hex = bent_hex(random, order, Mat3::Identity(), 0.1, pattern % 2 * 0.7);
        contraction.set_cell(hex.modes, hex.coefficients);
        contraction.take_steps();
        double sum_of_logs = 0;
        int count = 0;
        HexPart part;
        for (int round = 0; round < 30; ++round) {
          const HexPart next = random_part(random, contraction);
          if (round % 3 == 0) part = next;
          for (int d = 0; d < round % 3; ++d)  // so that contractions before it are shared
            part.levels[d] = next.levels[d], part.index[d] = next.index[d], part.tiers[d] = next.tiers[d];
          HexCoefficients wide;
          NarrowHexCoefficients narrow;
          contraction.contract(part, wide);
          contraction.contract(part, narrow);
          HexContraction fresh(basis, order);
          fresh.set_cell(hex.modes, hex.coefficients);
          fresh.take_steps();
          HexCoefficients fresh_wide;
          NarrowHexCoefficients fresh_narrow;
          fresh.contract(part, fresh_wide);
          fresh.contract(part, fresh_narrow);
          CAPTURE(basis, order, pattern, round, part.levels, part.index, part.tiers);
          REQUIRE(narrow.num_u() == wide.num_u());
          REQUIRE(narrow.num_w() == wide.num_w());
          for (int d = 0; d < 3; ++d) {
            double lowest = 1e300, highest = -1e300, largest = 0;
            bool is_as_fresh = narrow.precision.errors[d] == fresh_narrow.precision.errors[d];
            for (int n = 0; n < wide.num_vectors(); ++n)
              for (int p = 0; p < kWide; ++p) {
                const double x = wide.coordinate(d)[n][p], y = narrow.coordinate(d)[n][p];
                is_as_fresh =
                    is_as_fresh && x == fresh_wide.coordinate(d)[n][p] && y == fresh_narrow.coordinate(d)[n][p];
                lowest = std::min(lowest, x - y), highest = std::max(highest, x - y);
                largest = std::max(largest, std::abs(y));
              }
            CHECK(is_as_fresh);
            CHECK(highest - lowest <= 2 * narrow.precision.errors[d] + 1e-13);
            CHECK(largest <= narrow.precision.sizes[d]);
            sum_of_logs += std::log(narrow.precision.sizes[d] / largest);
            ++count;
          }
        }
        CHECK(std::exp(sum_of_logs / count) < 4);  // or parts would go over to double precision for nothing
      }
    }
}
