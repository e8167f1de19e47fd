// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/tuning/tuned_numbers.h"

#include "subvol/base/error.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <string>
#include <vector>

using namespace subvol;

namespace {

std::string message_of(const char* name, double value) {
  Tuning tuning;
  try {
    set_tuned_number(tuning, name, value);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("Tuned numbers have names, and each of them can be set", "[tuning]") {
  const std::vector<TunedNumber> numbers = tuned_numbers({});
  std::set<std::string> names;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const TunedNumber& number = numbers[i];
    INFO(number.name);
    names.insert(number.name);
    REQUIRE(number.value > 0);
    const double other = number.value < 1 ? 0.9375 : std::floor(number.value) + 1;
    Tuning tuning;
    set_tuned_number(tuning, number.name, other);
    const std::vector<TunedNumber> changed = tuned_numbers(tuning);
    for (std::size_t j = 0; j < numbers.size(); ++j) CHECK(changed[j].value == (i == j ? other : numbers[j].value));
  }
  CHECK(names.size() == numbers.size());
  Tuning tuning;
  set_tuned_number(tuning, "fitting.hessian_life", 2);
  CHECK(tuning.fitting.hessian_life == 2);
}

TEST_CASE("Unknown tuned numbers and values out of range are refused", "[tuning]") {
  CHECK(message_of("fitting.coarse_lambda", 0.5).empty());
  CHECK(message_of("fitting.coarse", 0.5).find("there is no tuned number 'fitting.coarse'") == 0);
  CHECK(message_of("fitting.coarse_lambda", 1) ==
        "the tuned number fitting.coarse_lambda is 1; it must be from 1e-09 to 0.99");
  CHECK(message_of("fitting.hessian_life", 2.5) ==
        "the tuned number fitting.hessian_life is 2.5; it must be whole, from 1 to 4000");
  CHECK(!message_of("fitting.unfolding_factor", 1).empty());  // lambda would never rise
  CHECK(message_of("curved.stiff_lambda", 1).empty());
  CHECK(message_of("quality.damping_rise", 0.5) ==
        "the tuned number quality.damping_rise is 0.5; it must be from 1.01 to 6000");
  // Points stiffened in single precision must not overflow, and no fold exceeds a full turn.
  CHECK(message_of("curved.most_stiffenings", 10).empty());
  CHECK(message_of("curved.most_stiffenings", 11) ==
        "the tuned number curved.most_stiffenings is 11; it must be whole, from 1 to 10");
  CHECK(!message_of("curved.stiffening_factor", 101).empty());
  CHECK(!message_of("quality.least_fold_limit", 360).empty());
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, infinity, -infinity, std::nan("")}) {
    CHECK(!message_of("fitting.back_off", bad).empty());
    CHECK(!message_of("curved.most_stiffenings", bad).empty());
  }
}
