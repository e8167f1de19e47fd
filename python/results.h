// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "python/meshes.h"
#include "python/report.h"
#include "subvol/mesh/fit_state.h"
#include "subvol/shell/curved_shell.h"

#include <memory>
#include <optional>
#include <vector>

namespace subvol::python {

/// A result with the report of the call.
struct Reported {
  py::dict report;
};

/// Result of `fit`: a cage and its finest mesh, or a mesh of curved cells and no cage.
struct Fitted : Reported {
  std::shared_ptr<VolumeMesh> template_mesh, cage, mesh;
  std::shared_ptr<CurvedMesh> curved;
  std::vector<FitState> states;
};

/// Result of `fill`.
struct Filled : Reported {
  std::shared_ptr<VolumeMesh> cage;  ///< null unless asked for
  std::shared_ptr<VolumeMesh> mesh;
};

/// Result of `optimize`: a mesh, or one of curved cells.
struct Optimized : Reported {
  std::shared_ptr<VolumeMesh> mesh;
  std::shared_ptr<CurvedMesh> curved;
};

/// Result of `shell`.
struct Shelled : Reported {
  ShellResult shell;
  std::optional<CurvedShell> curved_shell;
  std::shared_ptr<CurvedMesh> curved;
};

/// The curved mesh of a result if there is one, else the linear one.
template <class Result>
py::object mesh_of(const Result& result) {
  return result.curved ? py::cast(result.curved) : py::cast(result.mesh);
}

}  // namespace subvol::python
