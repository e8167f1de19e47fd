// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "subvol/fit/mending/mend_surface.h"
#include "subvol/shell/border_planes.h"
#include "subvol/shell/shell.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace subvol::cli {

/// How the surface of a shell is prepared.
struct ShellSurfaceOptions {
  std::string region;  ///< name or number of the region on whose boundary layers grow; empty: all regions
  ShellSide side = ShellSide::outward;  ///< on which layers grow
  std::vector<std::string> skipped;     ///< patches to leave out, each by group or point (`prepared_surface`)
  double repair_distance = 0;           ///< of `mend_surface`, in the surface's unit; 0: it is taken as it is
  std::function<bool()> cancelled;      ///< as in `mend_surface`
};

/// A patch that was left out.
struct SkippedPatch {
  std::string name;  ///< as the user gave it
  std::size_t faces;
  double area;
};

/// The surface on which layers grow, and how it came from the given one.
struct ShellSurface {
  PolygonMesh polygons;
  FeatureTags tags;
  std::vector<BorderPlane> border_planes;
  std::vector<Index> vertex_numbers, face_numbers;  ///< those of the given surface; empty: the same
  std::vector<SkippedPatch> skipped;
  std::optional<std::string> note;  ///< a sentence about faces between regions that were left out
  MendedSurface mended;             ///< its counts and distance only
  double repair_distance = 0;       ///< that was allowed
  bool is_cancelled = false;
};

/// Selects the boundary of a region, leaves patches out and mends the rest.
///
/// If sheets divide the inside of the surface into regions and none is named, layers grow outward on the boundary of
/// all regions together; InputError: they are to grow inward, where they would cross the sheets. UsageError: there is
/// no such region; the message lists the regions.
///
/// A patch is given by the name or the number of a group of faces, or as X,Y,Z: then it is the face closest to that
/// point and all faces that are connected with it through edges of at most `kPatchDegrees`. UsageError: there is no
/// such group; the message lists the groups. InputError: no face is left; as `mend_surface`.
ShellSurface prepared_surface(const TaggedPolygons& given, const ShellSurfaceOptions& options);

/// Sets tags, planes, numbers and thicknesses of the given vertices; creases of `options.tags` are added to the
/// surface's.
void take_surface(const ShellSurface& surface, ShellOptions& options);

/// A sentence about the repair, for warnings; nothing if the surface is as it was given.
std::optional<std::string> repair_warning(const ShellSurface& surface, double diagonal);

/// Entries "repair" and "skipped" of a report.
Json repair_json(const ShellSurface& surface, double diagonal);
Json skipped_json(const ShellSurface& surface);

/// Parses the distance of a repair: a length as `parse_length`, or 0 for none. UsageError: neither.
double parse_repair(const std::string& option, const std::string& text, double diagonal);

/// Layers and their growth.
struct LayerPlan {
  int layers = 1;
  double growth = 1;
};

/// Returns layers of a given first height. Without a growth, it follows from the number of layers; without a number of
/// layers, it follows from the growth, which is then adapted so that both lengths hold.
///
/// UsageError: neither is given, or both are and do not fit the lengths within 1 %. InputError: as `growth_of_layers`
/// and `number_of_layers`.
LayerPlan planned_layers(double thickness, double first_height, std::optional<int> layers,
                         std::optional<double> growth);

}  // namespace subvol::cli
