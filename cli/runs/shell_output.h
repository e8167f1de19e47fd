// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/outputs.h"
#include "cli/runs/writing.h"
#include "shell/curved_shell.h"

#include <optional>
#include <string>

namespace subvol::cli {

/// What is to be said of a surface that encloses something, up to small holes, and whose faces point into it.
std::optional<std::string> inward_warning(const TriangleMesh& surface);

/// Writes a shell: its cells with thickness at the vertices where the format has fields, its sheets as named nodes of a
/// scene, or its boundary as polygons.
void write_shell(const Output& output, const ShellResult& shell, const WritingOptions& options);
/// The same of a shell that has been curved; `shell` has its figures (`take_figures`). As a control mesh: the linear
/// cells.
void write_shell(const Output& output, const ShellResult& shell, const CurvedShell& curved,
                 const WritingOptions& options);
/// What is true of a curved shell in place of what was of the linear one; faces that meet are those of its boundary.
void take_figures(const CurvedShell& curved, ShellResult& shell);
/// UsageError: a format that cannot hold curved cells on such a surface.
void refuse_curved(const std::vector<Output>& outputs, const PolygonMesh& surface, int order);

/// Thicknesses of each side that has layers: asked, limited, achieved, clearance, also in per cent of a diagonal.
Json thickness_json(const ShellResult& shell, double diagonal);
/// The same in a line for each side.
std::string thickness_text(const ShellResult& shell);

}  // namespace subvol::cli
