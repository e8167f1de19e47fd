// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace subvol::internal {

/// Checks the header of a netCDF file in one of the classic formats (CDF-1, CDF-2, CDF-5): that it ends within the file
/// with all names, attributes and lists that it claims to have. netCDF takes memory for what a header claims before it
/// finds that it is not there.
///
/// name   of the file, for messages.
/// bytes  another format, such as HDF5, is not looked at.
/// InputError: a count, a name or a list is longer than the rest of the file, a tag or type is unknown, or a variable
/// has more than 1024 dimensions.
/// Source: the "File Format Specifications" of the netCDF documentation.
void require_sound_netcdf_header(const std::string& name, std::string_view bytes);

}  // namespace subvol::internal
