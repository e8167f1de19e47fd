// SPDX-License-Identifier: GPL-3.0-or-later
// Small files of simulation tools, written and read by tests.
#pragma once

#include "subvol/base/error.h"
#include "subvol/io/nodal_mesh.h"
#include "tests/support/temporary_folder.h"

#include <string>
#include <string_view>

namespace subvol::test {

/// The folder of the files that `read_nodal_text` reads. It lasts until the program ends.
inline const TemporaryFolder& nodal_folder() {
  static const TemporaryFolder kFolder;
  return kFolder;
}

/// Writes a file of this name and content, and reads it.
inline NodalMesh read_nodal_text(const std::string& name, std::string_view bytes, const std::string& references = {}) {
  return read_nodal_mesh(nodal_folder().file(name, bytes), references);
}

/// Returns the message with which the file is refused; empty if it is read.
inline std::string nodal_refusal(const std::string& name, std::string_view bytes) {
  try {
    read_nodal_text(name, bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace subvol::test
