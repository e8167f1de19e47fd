// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace subvol::internal {

/// Checks the header of a netCDF file in one of the classic formats (CDF-1, CDF-2, CDF-5): that it ends within the file
/// with all names, attributes and lists that it claims to have, and that its variables have known types and dimensions.
/// netCDF takes memory for what a header claims before it finds that it is not there, and divides by lengths of 0.
///
/// name   of the file, for messages.
/// bytes  another format, such as HDF5, is not looked at.
/// InputError: a count, a name or a list is longer than the rest of the file; a tag, a type or a dimension is unknown;
/// a variable has more than 1024 dimensions, or one of length 0 that is not its first.
/// Source: the "File Format Specifications" of the netCDF documentation.
void require_sound_netcdf_header(const std::string& name, std::string_view bytes);

}  // namespace subvol::internal
