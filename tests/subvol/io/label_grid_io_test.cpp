// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/label_grid_io.h"

#include "subvol/base/error.h"
#include "tests/support/temporary_folder.h"

#include <zlib.h>
#include <catch2/catch.hpp>

#include <cstring>
#include <numeric>
#include <string>

using namespace subvol;

namespace {

std::string gzipped(const std::string& bytes) {
  z_stream stream{};
  REQUIRE(deflateInit2(&stream, 6, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string result(bytes.size() + 100, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  REQUIRE(deflate(&stream, Z_FINISH) == Z_STREAM_END);
  result.resize(stream.total_out);
  deflateEnd(&stream);
  return result;
}

std::string npy(const std::string& type, bool fortran, const std::string& shape, const std::string& data) {
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (" + shape + "), }";
  header.resize(118, ' ');
  header.back() = '\n';
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(header.size()) + '\0' + header + data;
}

/// Labels 0 .. 23 as bytes.
std::string counted() {
  std::string bytes(24, '\0');
  std::iota(bytes.begin(), bytes.end(), '\0');
  return bytes;
}

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

std::string nifti() {
  std::string bytes(352, '\0');
  put<std::int32_t>(bytes, 0, 348);
  const std::int16_t dims[]{3, 2, 3, 4};
  for (std::size_t d = 0; d < 4; ++d) put(bytes, 40 + 2 * d, dims[d]);
  put<std::int16_t>(bytes, 70, 2);
  for (std::size_t d = 0; d < 4; ++d) put<float>(bytes, 76 + 4 * d, 1.5f);
  put<float>(bytes, 108, 352);
  bytes.replace(344, 4, std::string("n+1\0", 4));
  return bytes + counted();
}

}  // namespace

TEST_CASE("Segmentations are read from NumPy arrays of both orders", "[io]") {
  const test::TemporaryFolder files;
  const LabelGrid c = read_label_grid(files.file("c.npy", npy("|u1", false, "2, 3, 4", counted())));
  CHECK(c.counts == std::array<int, 3>{2, 3, 4});
  CHECK(c.labels[1] == 12);     // [1, 0, 0]
  CHECK(c.labels[2] == 4);      // [0, 1, 0]
  CHECK(c.labels[2 * 3] == 1);  // [0, 0, 1]
  const LabelGrid f = read_label_grid(files.file("f.npy", npy("|u1", true, "2, 3, 4", counted())));
  for (int i = 0; i < 24; ++i) CHECK(f.labels[static_cast<std::size_t>(i)] == i);
  std::string big;
  for (int i = 0; i < 8; ++i) big += {'\x01', static_cast<char>(i)};
  CHECK(read_label_grid(files.file("b.npy", npy(">i2", true, "2, 2, 2,", big))).labels[3] == 256 + 3);
}

TEST_CASE("Segmentations are read from NRRD and NIfTI with the place of their voxels", "[io]") {
  const test::TemporaryFolder files;
  const std::string header = "NRRD0004\n# a comment\ntype: uchar\ndimension: 3\nsizes: 2 3 4\n";
  for (const auto& [name, text] :
       {std::pair("raw.nrrd",
                  header + "encoding: raw\nspace directions: (2,0,0) (0,0,3) (0,-1,0)\nspace origin: (5,6,7)\n\n" +
                      counted()),
        {"gz.nrrd", header + "encoding: gzip\nspace directions: (2,0,0) (0,0,3) (0,-1,0)\nspace origin: (5,6,7)\n\n" +
                        gzipped(counted())}}) {
    const LabelGrid grid = read_label_grid(files.file(name, text));
    CHECK(grid.origin == Vec3(5, 6, 7));
    CHECK(grid.edges.col(1) == Vec3(0, 0, 3));
    for (int i = 0; i < 24; ++i) CHECK(grid.labels[static_cast<std::size_t>(i)] == i);
  }
  std::string words;
  for (int i = 0; i < 24; ++i) words += std::to_string(i) + (i % 5 == 0 ? "\n" : " ");
  const LabelGrid text = read_label_grid(files.file("t.nrrd", header + "encoding: ascii\nspacings: 1 2 3\n\n" + words));
  CHECK(text.labels[23] == 23);
  CHECK(text.edges(2, 2) == 3);
  for (const LabelGrid& grid :
       {read_label_grid(files.file("n.nii", nifti())), read_label_grid(files.file("n.nii.gz", gzipped(nifti())))}) {
    CHECK(grid.counts == std::array<int, 3>{2, 3, 4});
    CHECK(grid.edges(1, 1) == 1.5);
    CHECK(grid.labels[23] == 23);
  }
}

TEST_CASE("Labels that are refused are named by their voxel, with all digits", "[io]") {
  const test::TemporaryFolder files;
  const auto refused = [&](const std::string& name, const std::string& bytes, const std::string& what) {
    CHECK_THROWS_WITH(read_label_grid(files.file(name, bytes)), Catch::Contains(what));
  };
  std::string whole(24 * 8, '\0');
  put<std::int64_t>(whole, 8 * 7, 2147483647);
  CHECK(read_label_grid(files.file("fits.npy", npy("<i8", true, "2, 3, 4", whole))).labels[7] == 2147483647);
  put<std::int64_t>(whole, 8 * 7, 720575940621039145);
  refused("c.npy", npy("<i8", false, "2, 3, 4", whole),
          "voxel (0, 1, 3) has the value 720575940621039145, expected labels: whole numbers from 0 to 2147483647");
  refused("f.npy", npy("<u8", true, "2, 3, 4", whole), "voxel (1, 0, 1) has the value 720575940621039145,");
  put<std::int64_t>(whole, 8 * 7, -3);
  refused("n.npy", npy("<i8", true, "2, 3, 4", whole), "voxel (1, 0, 1) has the value -3,");
  put<double>(whole, 8 * 7, 0.25);
  refused("r.npy", npy("<f8", true, "2, 3, 4", whole), "voxel (1, 0, 1) has the value 0.25,");
  refused("h.npy", npy("<f2", true, "2, 3, 4", whole), "of type '<f2', expected integers of 8 to 64 bits, or whole");
  refused("b.nrrd", "NRRD0004\ntype: block\nsizes: 2 3 4\nencoding: raw\n\n", "of type 'block', expected integers");
  refused("t.nrrd", "NRRD0004\ntype: uchar\nsizes: 2 3 4\nencoding: ascii\n\n1 2 3",
          "it holds 3 numbers, expected 24, one for each voxel");
  std::string colors = nifti();
  put<std::int16_t>(colors, 70, 128);
  refused("rgb.nii", colors, "of type 128 of NIfTI, expected integers");
}

TEST_CASE("Damaged segmentations are refused with the cause", "[io]") {
  const test::TemporaryFolder files;
  const auto refused = [&](const std::string& name, const std::string& bytes, const std::string& what) {
    CHECK_THROWS_WITH(read_label_grid(files.file(name, bytes)), Catch::Contains(name) && Catch::Contains(what));
  };
  refused("a.npy", "NUMPY", "does not start");
  refused("a.npy", npy("|u1", false, "2, 3, 5", counted()), "24 bytes of data, expected 30");
  refused("a.npy", npy("|u1", false, "2, 12", counted()), "2 dimensions");
  refused("a.npy", npy("|u1", false, "99999, 99999, 99999", counted()), "2^31");
  refused("a.npy", npy("|u1", false, "1, 1, 90000000", counted()), "2^31");
  refused("a.npy", npy("<c8", false, "2, 3, 4", counted()), "of type");
  refused("a.npy", npy("|i1", false, "1, 1, 1", "\xff"), "expected labels");
  refused("a.nrrd", "NRRD0004\ntype: uchar\n", "ends within its header");
  refused("a.nrrd", "NRRD0004\ntype: uchar\nsizes: 2 3 4\nencoding: gzip\n\nxyz", "damaged or truncated");
  refused("a.nrrd", "NRRD0004\ntype: uchar\nsizes: 2 3 4\nencoding: raw\ndata file: b.raw\n\n", "another file");
  refused("a.nrrd", "NRRD0004\ntype: uchar\nsizes: 2 3 4\nencoding: raw\nspacings: 0 1 1\n\n" + counted(), "no volume");
  refused("a.nii", nifti().substr(0, 100), "shorter");
  refused("a.nii", nifti().substr(0, 360), "bytes of data");
  CHECK_THROWS_WITH(read_label_grid(files.file("a.txt", "")), Catch::Contains("expected a segmentation"));
}
