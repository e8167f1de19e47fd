// SPDX-License-Identifier: GPL-3.0-or-later
// The tests' main: a run in which nothing failed and something was left out ends with a status of its own, so that
// ctest tells skipped tests from those that passed, and never takes a failure for either.
#define CATCH_CONFIG_RUNNER
#include "tests/support/skipping.h"

#include <catch2/catch.hpp>

namespace {

bool any_skipped = false;

/// Looks for what tests WARN of.
struct SkipListener : Catch::TestEventListenerBase {
  using TestEventListenerBase::TestEventListenerBase;

  bool assertionEnded(const Catch::AssertionStats& stats) override {
    const auto& result = stats.assertionResult;
    if (result.getResultType() == Catch::ResultWas::Warning && subvol::test::says_skipped(result.getMessage()))
      any_skipped = true;
    return true;
  }
};

CATCH_REGISTER_LISTENER(SkipListener)

}  // namespace

int main(int argc, char** argv) {
  const int result = Catch::Session().run(argc, argv);
  return subvol::test::status_of_tests(result, any_skipped);
}
