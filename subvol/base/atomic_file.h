// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

namespace subvol {

/// Writes a whole file or nothing: to a temporary file in the same folder, which is flushed to the disk and then
/// renamed over `path`.
///
/// path     symbolic links are followed (`behind_links`); an existing regular file keeps its permissions; anything else
///          that exists and is not a folder (a pipe, a device, an open file by its /proc/.../fd/N) cannot be replaced
///          by a rename and is written to directly.
/// bytes    the whole content, possibly empty.
///
/// Throws IoError that names the path, the step and the system's reason; the temporary file is then removed and an
/// existing file is left as it was. Safe to call from several threads and processes at once: the last rename wins.
void write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// Returns the path to which a chain of symbolic links leads, even if no file is there; a path that is not a link is
/// returned as it is. Links of /proc, which stand for open files, are not followed. IoError: 40 links or more.
std::filesystem::path behind_links(const std::filesystem::path& path);

/// Returns true while a direct write (to a pipe, say) is under way, which may wait for its reader forever. For signal
/// handlers.
bool waits_for_reader() noexcept;

/// Deletes the temporary files of all writes under way, which then fail: at most 16 of them, with names below 4096
/// bytes. For signal handlers that end the process at once.
void delete_temporaries() noexcept;

}  // namespace subvol
