// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/outputs.h"
#include "cli/runs/writing.h"
#include "subvol/shell/curved_shell.h"

#include <optional>
#include <string>
#include <vector>

namespace subvol::cli {

/// Returns a warning if a surface encloses something, except for small holes, and its faces point inward; otherwise
/// nothing.
std::optional<std::string> inward_warning(const TriangleMesh& surface);

/// Writes a shell: its cells, with the thickness at the vertices if the format has fields; its sheets as named nodes of
/// a scene; or its boundary as polygons.
void write_shell(const Output& output, const ShellResult& shell, const WritingOptions& options);
/// Writes a shell that has been curved; `shell` must have its figures (`take_figures`). A control mesh consists of the
/// linear cells.
void write_shell(const Output& output, const ShellResult& shell, const CurvedShell& curved,
                 const WritingOptions& options);
/// Replaces the figures of the linear shell by those of the curved one; pairs of faces that meet are those of its
/// boundary.
void take_figures(const CurvedShell& curved, ShellResult& shell);
/// UsageError: a format that cannot hold curved cells on such a surface.
void refuse_curved(const std::vector<Output>& outputs, const PolygonMesh& surface, int order);

/// Thicknesses of each side that has layers: requested, limited, achieved, and clearance, also in percent of a
/// diagonal.
Json thickness_json(const ShellResult& shell, double diagonal);
/// Number of layers on each side, their growth, and the first layer's height in the middle of what was achieved.
Json layers_json(const ShellResult& shell);
/// Columns that stay in planes of the border, and their largest distance from them.
Json border_json(const ShellResult& shell, double diagonal);
/// The groups of the shell's faces: name, number, number of faces and area; those of the given surface also have their
/// area there.
Json shell_groups_json(const ShellResult& shell, const PolygonMesh& given);
/// Scaled Jacobian at the corners of the linear cells, relative to the ideal cells.
Json corner_quality_json(const ShellResult& shell);
/// Warnings about sides whose layers are much thinner than asked for, or whose first layer is, on average, more than a
/// tenth off the height that was asked for. first_height: nothing if none was.
std::vector<std::string> thickness_warnings(const ShellResult& shell, std::optional<double> first_height);
/// The thicknesses as text, one line for each side.
std::string thickness_text(const ShellResult& shell);

}  // namespace subvol::cli
