// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/io/vtk_xml_arrays.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace pugi {
class xml_document;
class xml_node;
}  // namespace pugi

namespace subvol::internal {

/// A VTK XML file in memory (.vtu, .vtp). Its bytes must outlive it.
class VtkXmlFile {
 public:
  /// type: of the grid, such as "UnstructuredGrid". InputError, naming the file: no XML, another type, a version beyond
  /// 2.2.
  VtkXmlFile(const std::string& name, std::string_view bytes, const char* type);
  ~VtkXmlFile();

  [[noreturn]] void fail(const std::string& what) const;

  /// The element of the grid, which holds pieces.
  pugi::xml_node grid() const;
  const VtkXmlStorage& storage() const { return storage_; }
  /// True before version 2.1, where the last two edges of a Lagrange hex are swapped.
  bool old_numbers() const { return old_numbers_; }

  static VtkXmlArray described(const pugi::xml_node& array);
  /// The numbers of an array. InputError: they cannot be read.
  std::vector<double> values(const pugi::xml_node& array) const;
  /// The numbers of the array of this name in an element. InputError: there is none, or they are no whole numbers.
  std::vector<std::int64_t> whole_numbers(const pugi::xml_node& parent, const char* array) const;
  /// Appends the points of a piece and returns their number. InputError: not as many as the piece claims, numbers that
  /// are not finite, more points than an index can tell.
  std::size_t append_points(const pugi::xml_node& piece, std::vector<Vec3>& points) const;
  /// The number that an attribute claims, 0 if there is none; nothing is allocated for it. InputError: more than an
  /// index can tell, so that sums of a few of them are numbers, too.
  std::size_t claimed(const pugi::xml_node& piece, const char* attribute) const;

 private:
  std::string name_, type_, text_;
  std::unique_ptr<pugi::xml_document> document_;
  VtkXmlStorage storage_;
  bool old_numbers_ = false;
};

}  // namespace subvol::internal
