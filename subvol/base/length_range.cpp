// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/length_range.h"

#include "subvol/base/error.h"

#include <sstream>

namespace subvol::internal {

void require_length(double extent, const char* what) {
  if (extent >= kLeastSupportedLength && extent <= kMostSupportedLength) return;
  std::ostringstream said;
  said << what << ": its extent is " << extent << ", expected " << kLeastSupportedLength << " to "
       << kMostSupportedLength;
  throw InputError(said.str());
}

}  // namespace subvol::internal
