// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

namespace subvol {

/// Writes a whole file or nothing: into a temporary in the same folder, flushed to the disk, then renamed over `path`.
///
/// path     symbolic links are followed (`behind_links`); an existing regular file keeps its permissions; anything else
///          that exists and is no folder (a pipe, a device, an open file by its /proc/.../fd/N) cannot be renamed over
///          and is written to directly.
/// bytes    the whole content, possibly empty.
///
/// Throws IoError that names the path, the step and the system's reason; the temporary is removed and an existing file
/// is left as it was. Safe to call from several threads and processes at once: the last rename wins.
void write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// Where a chain of symbolic links leads, whether a file is there or not; a path that is none leads to itself. Links of
/// /proc, which stand for open files, are not followed. IoError: more than 40 links.
std::filesystem::path behind_links(const std::filesystem::path& path);

/// Whether some write waits for the reader of a pipe, possibly for ever. For signal handlers.
bool waits_for_reader() noexcept;

/// Deletes the temporaries of all writes under way (16 at a time at most, of names below 4096 bytes), which then fail.
/// For signal handlers that end the process at once.
void delete_temporaries() noexcept;

}  // namespace subvol
