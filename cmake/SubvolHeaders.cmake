# SPDX-License-Identifier: GPL-3.0-or-later
# The public headers. Headers are named "subvol/<room>/<name>.h", in this project and by those who use it.
#
# Sets SUBVOL_INCLUDE_DIR, the folder that holds `subvol/` as it is installed, made of links; and SUBVOL_PUBLIC_HEADERS,
# paths from the root of the project: the headers below and those that they include.

set(entry_points
  # Meshes, surfaces, their topology and files
  subvol/base/atomic_file.h
  subvol/base/error.h
  subvol/base/types.h
  subvol/base/version.h
  subvol/io/color_groups.h
  subvol/io/file_formats.h
  subvol/io/label_grid_io.h
  subvol/io/mesh_io.h
  subvol/io/nodal_mesh.h
  subvol/io/surface_io.h
  subvol/mesh/cell_topology.h
  subvol/mesh/face_groups.h
  subvol/mesh/feature_tags.h
  subvol/mesh/features.h
  subvol/mesh/mesh_topology.h
  subvol/mesh/validate.h
  subvol/mesh/volume_mesh.h
  subvol/surface/boundary.h
  subvol/surface/point_cloud.h
  subvol/surface/region_surface.h
  subvol/surface/solid_topology.h
  subvol/surface/surface_topology.h
  subvol/surface/triangle_mesh.h
  # Subdivision volumes
  subvol/subdivision/audit.h
  subvol/subdivision/limit_surface.h
  subvol/subdivision/patch_surface.h
  subvol/subdivision/sparse_map.h
  subvol/subdivision/subdivision.h
  # Templates
  subvol/templates/auto_template.h
  subvol/templates/carve.h
  subvol/templates/cell_sheet.h
  subvol/templates/cell_split.h
  subvol/templates/label_surface.h
  subvol/templates/pillow.h
  subvol/templates/refine.h
  subvol/templates/region_template.h
  subvol/templates/vertex_merge.h
  # Fits, optimization, checks
  fit/automatic_fit.h
  fit/certificate/certificate.h
  fit/elements/high_order_mesh.h
  fit/energies/distortion_kind.h
  fit/geometry/closest_point.h
  fit/geometry/surface_distance.h
  fit/high_order_fit.h
  fit/mesh_check.h
  fit/mending/mend_surface.h
  fit/mending/surface_repair.h
  fit/optimize_curved.h
  fit/optimize_mesh.h
  fit/quality/quality.h
  fit/subdivision_fit.h
  fit/target/surface_diagnosis.h
  fit/target/surface_wrap.h
  fit/template_fit.h
  fit/tuning/tuned_numbers.h
  fit/untangle_before_fit.h
  # Shells
  shell/curved_shell.h
  shell/extrude.h
  shell/partial_surface.h
  shell/shell.h
  # Files of results
  export/animation.h
  export/boundary_file.h
  export/curved_file.h
  export/cutaway.h
  export/export.h
  export/gltf_writer.h
  export/high_order_file.h
  export/nodal_export.h
  export/obj_writer.h
  export/raster.h
  export/read_back.h
  export/scene.h
  export/surface_writer.h
  export/tessellate.h
  export/usd_writer.h
  export/volume_writer.h)

set(SUBVOL_INCLUDE_DIR "${PROJECT_BINARY_DIR}/include")
file(MAKE_DIRECTORY "${SUBVOL_INCLUDE_DIR}/subvol")
foreach(folder base mesh surface io subdivision templates)
  file(CREATE_LINK "${PROJECT_SOURCE_DIR}/subvol/${folder}" "${SUBVOL_INCLUDE_DIR}/subvol/${folder}"
    COPY_ON_ERROR SYMBOLIC)
endforeach()
foreach(folder fit shell export)
  file(CREATE_LINK "${PROJECT_SOURCE_DIR}/${folder}" "${SUBVOL_INCLUDE_DIR}/subvol/${folder}" COPY_ON_ERROR SYMBOLIC)
endforeach()
configure_file("${PROJECT_SOURCE_DIR}/cmake/version_macros.h.in" "${SUBVOL_INCLUDE_DIR}/subvol/version_macros.h" @ONLY)

set(SUBVOL_PUBLIC_HEADERS "")
set(open ${entry_points})
while(open)
  list(POP_FRONT open header)
  if(header IN_LIST SUBVOL_PUBLIC_HEADERS)
    continue()
  endif()
  if(NOT EXISTS "${PROJECT_SOURCE_DIR}/${header}")
    message(FATAL_ERROR "cmake/SubvolHeaders.cmake names a header that does not exist: ${header}")
  endif()
  list(APPEND SUBVOL_PUBLIC_HEADERS "${header}")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${header}")
  file(STRINGS "${PROJECT_SOURCE_DIR}/${header}" lines REGEX "^#include \"subvol/")
  foreach(line ${lines})
    string(REGEX REPLACE "^#include \"subvol/([^\"]+)\".*" "\\1" included "${line}")
    if(NOT included MATCHES "^(fit|shell|export)/")
      set(included "subvol/${included}")
    endif()
    list(APPEND open "${included}")
  endforeach()
endwhile()
list(SORT SUBVOL_PUBLIC_HEADERS)
