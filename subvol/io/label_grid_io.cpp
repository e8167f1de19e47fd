// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/label_grid_io.h"

#include "subvol/base/binary_value.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/length_range.h"
#include "subvol/base/text_scanner.h"

#include <zlib.h>
#include <Eigen/Dense>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// Reports what is wrong with one file.
class FileText {
 public:
  explicit FileText(const std::filesystem::path& path) : name_(path.string()) {}
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }

 private:
  std::string name_;
};

/// Inflates gzip data to at most so many bytes.
std::string inflated(std::string_view data, std::size_t most, const FileText& file) {
  constexpr std::size_t kInflateChunkBytes = 1 << 20;
  constexpr int kGzip = 16;  // added to the window size: a gzip header is expected
  z_stream stream{};
  if (inflateInit2(&stream, MAX_WBITS + kGzip) != Z_OK) file.fail("memory is short for decompression");
  std::string result;
  std::size_t taken = 0;
  int status = Z_OK;
  while (status == Z_OK && result.size() <= most) {
    if (stream.avail_in == 0) {
      const std::size_t size = std::min<std::size_t>(data.size() - taken, std::numeric_limits<uInt>::max());
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data() + taken));
      stream.avail_in = static_cast<uInt>(size);
      taken += size;
    }
    const std::size_t before = result.size();
    result.resize(before + kInflateChunkBytes);
    stream.next_out = reinterpret_cast<Bytef*>(result.data() + before);
    stream.avail_out = static_cast<uInt>(kInflateChunkBytes);
    status = inflate(&stream, Z_NO_FLUSH);
    result.resize(before + kInflateChunkBytes - stream.avail_out);
    if (status == Z_BUF_ERROR && stream.avail_in == 0 && taken == data.size()) break;
    if (status == Z_BUF_ERROR) status = Z_OK;
  }
  inflateEnd(&stream);
  if (status != Z_OK && status != Z_STREAM_END) file.fail("the compressed data are damaged or truncated");
  return result;
}

enum class VoxelOrder { first_axis_runs_fastest, last_axis_runs_fastest };

/// Returns the name of a voxel, as (i, j, k), by its place in an order of voxels.
std::string voxel_name(const LabelGrid& grid, std::size_t place, VoxelOrder order) {
  std::array<std::size_t, 3> at{};
  for (std::size_t n = 0; n < 3; ++n) {
    const std::size_t axis = order == VoxelOrder::first_axis_runs_fastest ? n : 2 - n;
    at[axis] = place % static_cast<std::size_t>(grid.counts[axis]);
    place /= static_cast<std::size_t>(grid.counts[axis]);
  }
  return formatted("voxel (%zu, %zu, %zu)", at[0], at[1], at[2]);
}

/// Returns a number of a file as text, whole numbers with all digits.
std::string value_text(const char* bytes, ValueType type, std::endian order) {
  if (type.is_real()) return formatted("%.9g", decode(bytes, type, order));
  const std::uint64_t bits = decode_bits(bytes, type, order);
  return type.values == ValueType::Class::whole ? std::to_string(static_cast<std::int64_t>(bits))
                                                : std::to_string(bits);
}

[[noreturn]] void refuse_type(const std::string& type, const FileText& file) {
  file.fail("its numbers are of type " + type +
            ", expected integers of 8 to 64 bits, or whole numbers as floats of 32 or 64 bits");
}

/// Sets the labels of a grid, whose counts are set, from numbers in an order of voxels, which they keep.
void take_labels(LabelGrid& grid, std::string_view data, ValueType type, std::endian order, const FileText& file,
                 VoxelOrder voxels = VoxelOrder::first_axis_runs_fastest) {
  std::size_t count = 1;
  for (const int n : grid.counts) count *= static_cast<std::size_t>(n);
  if (data.size() / type.size < count)
    file.fail("it holds " + std::to_string(data.size()) + " bytes of data, expected " +
              std::to_string(count * type.size) + " for " + std::to_string(count) + " voxels");
  grid.labels.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double value = decode(data.data() + i * type.size, type, order);
    if (!(value >= 0 && value <= std::numeric_limits<int>::max()) || value != std::floor(value))
      file.fail(voxel_name(grid, i, voxels) + " has the value " + value_text(data.data() + i * type.size, type, order) +
                ", expected labels: whole numbers from 0 to " + std::to_string(std::numeric_limits<int>::max()));
    grid.labels[i] = static_cast<int>(value);
  }
}

/// Sets the counts from three or more numbers.
void take_counts(LabelGrid& grid, std::span<const double> sizes, const FileText& file) {
  std::size_t dimensions = sizes.size();
  while (dimensions > 3 && sizes[dimensions - 1] == 1) --dimensions;
  if (dimensions != 3) file.fail("it has " + std::to_string(dimensions) + " dimensions, expected 3");
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(sizes[a] >= 1 && sizes[a] <= std::numeric_limits<int>::max()) || sizes[a] != std::floor(sizes[a]))
      file.fail("an axis has " + std::to_string(sizes[a]) + " voxels, expected 1 or more");
    grid.counts[a] = static_cast<int>(sizes[a]);
  }
  if (!can_number_voxels(grid.counts))
    file.fail("it has more than 2^31 - 1 voxels, those of the empty layers around it included");
}

void require_sound_axes(const LabelGrid& grid, const FileText& file) {
  const double largest = grid.edges.cwiseAbs().maxCoeff();
  if (!grid.edges.allFinite() || !grid.origin.allFinite() ||
      !(largest >= kLeastSupportedLength && largest <= kMostSupportedLength) ||
      !(std::abs(grid.edges.determinant()) > 1e-9 * std::pow(largest, 3)))
    file.fail("its voxels have no volume, or a place that is not finite");
}

/// Returns the numbers at the start of a text, separated by spaces, commas and parentheses.
std::vector<double> numbers_in(std::string_view text) {
  constexpr std::string_view kNumberSeparators = " \t\r\n(),";
  std::vector<double> numbers;
  for (std::size_t at = text.find_first_not_of(kNumberSeparators); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kNumberSeparators, at), text.size());
    double number = 0;
    const auto [last, error] = std::from_chars(text.data() + at, text.data() + end, number);
    if (error != std::errc() || last != text.data() + end) break;
    numbers.push_back(number);
    at = text.find_first_not_of(kNumberSeparators, end);
  }
  return numbers;
}

// NumPy

std::string value_in_dict(const std::string& header, const std::string& key, const FileText& file) {
  const std::size_t at = header.find("'" + key + "'");
  const std::size_t colon = at == std::string::npos ? at : header.find(':', at);
  if (colon == std::string::npos) file.fail("its header has no " + in_quotes(key));
  const std::size_t from = header.find_first_not_of(' ', colon + 1);
  if (from == std::string::npos) file.fail("its header ends within " + in_quotes(key));
  const char closing = header[from] == '(' ? ')' : ',';
  const std::size_t end = header.find_first_of(closing == ')' ? ")" : ",}", from);
  if (end == std::string::npos) file.fail("its header ends within " + in_quotes(key));
  return header.substr(from, end - from);
}

ValueType numpy_type(const std::string& text, std::endian& order, const FileText& file) {
  const std::string word = text.size() > 2 ? text.substr(1, text.size() - 2) : "";  // without its quotes
  static const std::map<std::string, ValueType> kTypes{
      {"b1", kUInt8}, {"u1", kUInt8},  {"i1", kInt8},  {"u2", kUInt16},  {"i2", kInt16},  {"u4", kUInt32},
      {"i4", kInt32}, {"u8", kUInt64}, {"i8", kInt64}, {"f4", kFloat32}, {"f8", kFloat64}};
  const auto at = word.size() == 3 ? kTypes.find(word.substr(1)) : kTypes.end();
  if (at == kTypes.end()) refuse_type(in_quotes(word), file);
  order = word[0] == '>' ? std::endian::big : std::endian::little;
  return at->second;
}

LabelGrid read_numpy(const std::string& bytes, const FileText& file) {
  constexpr std::size_t kNumpyVersionAt = 6, kNumpyLengthAt = 8;
  if (!bytes.starts_with("\x93NUMPY") || bytes.size() < kNumpyLengthAt + 4)
    file.fail("it does not start as a .npy file does");
  const bool is_long = bytes[kNumpyVersionAt] >= 2;
  const auto length =
      static_cast<std::size_t>(decode(bytes.data() + kNumpyLengthAt, is_long ? kUInt32 : kUInt16, std::endian::little));
  const std::size_t begin = kNumpyLengthAt + (is_long ? 4 : 2);
  if (length > bytes.size() - begin) file.fail("it ends within its header");
  const std::string header = bytes.substr(begin, length);
  std::endian order = std::endian::little;
  const ValueType type = numpy_type(value_in_dict(header, "descr", file), order, file);
  const bool is_fortran = value_in_dict(header, "fortran_order", file) == "True";
  LabelGrid grid;
  take_counts(grid, numbers_in(value_in_dict(header, "shape", file)), file);
  take_labels(grid, std::string_view(bytes).substr(begin + length), type, order, file,
              is_fortran ? VoxelOrder::first_axis_runs_fastest : VoxelOrder::last_axis_runs_fastest);
  if (is_fortran) return grid;
  std::vector<int> ordered(grid.labels.size());
  std::size_t from = 0;
  for (int i = 0; i < grid.counts[0]; ++i)
    for (int j = 0; j < grid.counts[1]; ++j)
      for (int k = 0; k < grid.counts[2]; ++k)
        ordered[static_cast<std::size_t>(i) +
                static_cast<std::size_t>(grid.counts[0]) *
                    (static_cast<std::size_t>(j) +
                     static_cast<std::size_t>(grid.counts[1]) * static_cast<std::size_t>(k))] = grid.labels[from++];
  grid.labels = std::move(ordered);
  return grid;
}

// NRRD

ValueType nrrd_type(const std::string& text, const FileText& file) {
  static const std::map<std::string, ValueType> kTypes{{"signed char", kInt8},    {"int8", kInt8},
                                                       {"int8_t", kInt8},         {"uchar", kUInt8},
                                                       {"unsigned char", kUInt8}, {"uint8", kUInt8},
                                                       {"uint8_t", kUInt8},       {"short", kInt16},
                                                       {"short int", kInt16},     {"signed short", kInt16},
                                                       {"int16", kInt16},         {"int16_t", kInt16},
                                                       {"ushort", kUInt16},       {"unsigned short", kUInt16},
                                                       {"uint16", kUInt16},       {"uint16_t", kUInt16},
                                                       {"int", kInt32},           {"signed int", kInt32},
                                                       {"int32", kInt32},         {"int32_t", kInt32},
                                                       {"uint", kUInt32},         {"unsigned int", kUInt32},
                                                       {"uint32", kUInt32},       {"uint32_t", kUInt32},
                                                       {"longlong", kInt64},      {"long long", kInt64},
                                                       {"int64", kInt64},         {"int64_t", kInt64},
                                                       {"ulonglong", kUInt64},    {"unsigned long long", kUInt64},
                                                       {"uint64", kUInt64},       {"uint64_t", kUInt64},
                                                       {"float", kFloat32},       {"double", kFloat64}};
  const auto at = kTypes.find(text);
  if (at == kTypes.end()) refuse_type(in_quotes(text), file);
  return at->second;
}

/// The fields of a header, and where it ends.
struct NrrdHeader {
  std::map<std::string, std::string> fields;
  std::size_t end = 0;
  const std::string* find(const std::string& key) const {
    const auto at = fields.find(key);
    return at == fields.end() ? nullptr : &at->second;
  }
};

NrrdHeader nrrd_header(const std::string& bytes, const FileText& file) {
  NrrdHeader header;
  bool is_first = true;
  while (true) {
    const std::size_t newline = bytes.find('\n', header.end);
    if (newline == std::string::npos) file.fail("it ends within its header");
    std::string line = bytes.substr(header.end, newline - header.end);
    header.end = newline + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (is_first && !line.starts_with("NRRD000")) file.fail("it does not start as a .nrrd file does");
    if (line.empty()) return header;
    const std::size_t colon = line.find(": ");
    if (!is_first && line[0] != '#' && colon != std::string::npos) {
      std::string value = line.substr(colon + 2);
      while (!value.empty() && value.back() == ' ') value.pop_back();
      header.fields[line.substr(0, colon)] = value;
    }
    is_first = false;
  }
}

LabelGrid read_nrrd(const std::string& bytes, const FileText& file) {
  const NrrdHeader header = nrrd_header(bytes, file);
  const auto field = [&](const char* key) -> const std::string& {
    const std::string* found = header.find(key);
    if (!found) file.fail("its header has no " + in_quotes(key));
    return *found;
  };
  for (const char* detached : {"data file", "datafile"})
    if (header.find(detached)) file.fail("its data are in another file, expected them in this one");
  LabelGrid grid;
  take_counts(grid, numbers_in(field("sizes")), file);
  const ValueType type = nrrd_type(field("type"), file);
  if (const std::string* directions = header.find("space directions")) {
    const std::vector<double> numbers = numbers_in(*directions);
    if (numbers.size() < 9) file.fail("its space directions are not three vectors of three numbers");
    for (int a = 0; a < 3; ++a) grid.edges.col(a) = Vec3(numbers[3 * a], numbers[3 * a + 1], numbers[3 * a + 2]);
  } else if (const std::string* spacings = header.find("spacings")) {
    const std::vector<double> numbers = numbers_in(*spacings);
    if (numbers.size() < 3) file.fail("its spacings are not three numbers");
    for (int a = 0; a < 3; ++a)
      if (std::isfinite(numbers[a])) grid.edges(a, a) = numbers[a];
  }
  if (const std::string* origin = header.find("space origin")) {
    const std::vector<double> numbers = numbers_in(*origin);
    if (numbers.size() != 3) file.fail("its space origin is not three numbers");
    grid.origin = {numbers[0], numbers[1], numbers[2]};
  }
  require_sound_axes(grid, file);
  const std::string& encoding = field("encoding");
  const std::string_view rest = std::string_view(bytes).substr(header.end);
  const std::size_t size = static_cast<std::size_t>(grid.counts[0]) * static_cast<std::size_t>(grid.counts[1]) *
                           static_cast<std::size_t>(grid.counts[2]) * type.size;
  const std::string* endian = header.find("endian");
  const std::endian order = endian && *endian == "big" ? std::endian::big : std::endian::little;
  if (encoding == "raw") {
    take_labels(grid, rest, type, order, file);
  } else if (encoding == "gzip" || encoding == "gz") {
    take_labels(grid, inflated(rest, size, file), type, order, file);
  } else if (encoding == "ascii" || encoding == "text" || encoding == "txt") {
    std::string doubles;
    for (const double number : numbers_in(rest)) doubles.append(reinterpret_cast<const char*>(&number), sizeof number);
    if (doubles.size() / sizeof(double) * type.size < size)
      file.fail("it holds " + std::to_string(doubles.size() / sizeof(double)) + " numbers, expected " +
                std::to_string(size / type.size) + ", one for each voxel");
    take_labels(grid, doubles, kFloat64, std::endian::native, file);
  } else {
    file.fail("its encoding is " + in_quotes(encoding) + ", expected raw, gzip or ascii");
  }
  return grid;
}

// NIfTI

LabelGrid read_nifti(const std::string& bytes, const FileText& file) {
  // The size of the header of NIfTI-1, and places in it.
  constexpr std::size_t kNiftiHeaderBytes = 348, kNiftiDimAt = 40, kNiftiTypeAt = 70, kNiftiPixdimAt = 76,
                        kNiftiVoxelOffsetAt = 108, kNiftiSlopeAt = 112, kNiftiInterceptAt = 116, kNiftiQformAt = 252,
                        kNiftiSformAt = 254, kNiftiQuaternionAt = 256, kNiftiQoffsetAt = 268, kNiftiRowsAt = 280,
                        kNiftiMagicAt = 344;
  if (bytes.size() < kNiftiHeaderBytes + 4) file.fail("it is shorter than a NIfTI-1 header");
  std::endian order = std::endian::little;
  if (decode(bytes.data(), kInt32, order) != kNiftiHeaderBytes) order = std::endian::big;
  if (decode(bytes.data(), kInt32, order) != kNiftiHeaderBytes || bytes.compare(kNiftiMagicAt, 3, "n+1") != 0)
    file.fail("it does not start as a NIfTI-1 file with its volume does");
  const auto number = [&](std::size_t at, ValueType type) { return decode(bytes.data() + at, type, order); };
  static const std::map<int, ValueType> kTypes{{2, kUInt8},    {4, kInt16},    {8, kInt32},    {16, kFloat32},
                                               {64, kFloat64}, {256, kInt8},   {512, kUInt16}, {768, kUInt32},
                                               {1024, kInt64}, {1280, kUInt64}};
  const int code = static_cast<int>(number(kNiftiTypeAt, kInt16));
  const auto type = kTypes.find(code);
  if (type == kTypes.end()) refuse_type(std::to_string(code) + " of NIfTI", file);
  const double dimensions = number(kNiftiDimAt, kInt16);
  if (!(dimensions >= 1 && dimensions <= 7)) file.fail("its number of dimensions is out of range");
  std::vector<double> sizes;
  for (int d = 1; d <= static_cast<int>(dimensions); ++d) sizes.push_back(number(kNiftiDimAt + 2 * d, kInt16));
  LabelGrid grid;
  take_counts(grid, sizes, file);
  const double slope = number(kNiftiSlopeAt, kFloat32), intercept = number(kNiftiInterceptAt, kFloat32);
  if ((slope != 0 && slope != 1) || (slope == 1 && intercept != 0))
    file.fail("its numbers are scaled, expected labels");
  std::array<double, 4> pixdim;
  for (std::size_t d = 0; d < 4; ++d) pixdim[d] = number(kNiftiPixdimAt + 4 * d, kFloat32);
  if (number(kNiftiSformAt, kInt16) > 0) {
    for (int row = 0; row < 3; ++row) {
      for (int a = 0; a < 3; ++a) grid.edges(row, a) = number(kNiftiRowsAt + 16 * row + 4 * a, kFloat32);
      grid.origin[row] = number(kNiftiRowsAt + 16 * row + 12, kFloat32);
    }
  } else {
    Mat3 turn = Mat3::Identity();
    if (number(kNiftiQformAt, kInt16) > 0) {
      const double b = number(kNiftiQuaternionAt, kFloat32), c = number(kNiftiQuaternionAt + 4, kFloat32),
                   d = number(kNiftiQuaternionAt + 8, kFloat32);
      turn = Eigen::Quaterniond(std::sqrt(std::max(0.0, 1 - b * b - c * c - d * d)), b, c, d).toRotationMatrix();
      if (pixdim[0] < 0) turn.col(2) *= -1;
      for (int a = 0; a < 3; ++a) grid.origin[a] = number(kNiftiQoffsetAt + 4 * a, kFloat32);
    }
    for (int a = 0; a < 3; ++a) grid.edges.col(a) = pixdim[a + 1] * turn.col(a);
  }
  require_sound_axes(grid, file);
  const double offset = number(kNiftiVoxelOffsetAt, kFloat32);
  if (!(offset >= kNiftiHeaderBytes && offset <= static_cast<double>(bytes.size())))
    file.fail("its volume starts beyond its end");
  take_labels(grid, std::string_view(bytes).substr(static_cast<std::size_t>(offset)), type->second, order, file);
  return grid;
}

std::string format_of(const std::filesystem::path& path) {
  std::string extension = lower_case(path.extension().string());
  if (extension == ".gz") extension = lower_case(path.stem().extension().string()) + ".gz";
  return extension;
}

}  // namespace

LabelGrid read_label_grid(const std::filesystem::path& path) {
  const FileText file(path);
  const std::string format = format_of(path);
  if (!is_label_grid_file(path)) file.fail("expected a segmentation: " + label_grid_formats());
  const std::string bytes = read_file(path);
  if (format == ".npy") return read_numpy(bytes, file);
  if (format == ".nrrd") return read_nrrd(bytes, file);
  constexpr std::size_t kMostBytes = std::size_t{1} << 34;  // eight bytes for each voxel that can be numbered
  return read_nifti(format == ".nii.gz" ? inflated(bytes, kMostBytes, file) : bytes, file);
}

bool is_label_grid_file(const std::filesystem::path& path) {
  const std::string format = format_of(path);
  return format == ".npy" || format == ".nrrd" || format == ".nii" || format == ".nii.gz";
}

std::string label_grid_formats() { return ".npy, .nrrd, .nii, .nii.gz"; }

}  // namespace subvol
