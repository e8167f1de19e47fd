// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/zip_archive.h"

#include "subvol/base/binary_value.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <limits>

namespace subvol::internal {

namespace {

constexpr std::size_t kEndSize = 22, kDirectoryEntrySize = 46, kHeaderSize = 30;
constexpr std::size_t kStored = 0, kDeflated = 8;
constexpr std::size_t kLongEndSize = 56, kLocatorSize = 20;  // of ZIP64
constexpr std::string_view kEndMark("PK\5\6"), kDirectoryMark("PK\1\2"), kHeaderMark("PK\3\4");
constexpr std::string_view kLongEndMark("PK\6\6"), kLocatorMark("PK\6\7");
constexpr std::size_t kLongValues = 1;                                      // number of the extra field of ZIP64
constexpr std::size_t kIsLong = std::numeric_limits<std::uint32_t>::max();  // the value stands in that field

/// size  2, 4 or 8 bytes
std::size_t number_at(std::string_view bytes, std::size_t at, std::size_t size) {
  if (size == 8) return number_at(bytes, at, 4) | number_at(bytes, at + 4, 4) << 32;
  return static_cast<std::size_t>(decode(bytes.data() + at, size == 2 ? kUInt16 : kUInt32, std::endian::little));
}

/// Replaces those values of an entry that have no room in 32 bits by the ones in its extra fields, where they stand in
/// the same order. Returns false if one of them is missing.
bool read_long_values(std::string_view extra, std::initializer_list<std::size_t*> values) {
  constexpr std::size_t kFieldSize = 4, kValueSize = 8;  // of a field's number and length; of a value
  std::string_view field;
  for (std::size_t at = 0; at + kFieldSize <= extra.size(); at += kFieldSize + number_at(extra, at + 2, 2))
    if (number_at(extra, at, 2) == kLongValues) field = extra.substr(at + kFieldSize, number_at(extra, at + 2, 2));
  for (std::size_t* value : values) {
    if (*value != kIsLong) continue;
    if (field.size() < kValueSize) return false;
    *value = number_at(field, 0, kValueSize);
    field.remove_prefix(kValueSize);
  }
  return true;
}

/// Tells where the directory of an archive begins, and how many entries it has.
struct Directory {
  std::size_t begin, count;
};

/// end  where the end record stands. In ZIP64 a longer one stands before it.
Directory directory_of(std::string_view bytes, std::size_t end) {
  if (end >= kLocatorSize && bytes.substr(end - kLocatorSize, kLocatorMark.size()) == kLocatorMark) {
    const std::size_t record = number_at(bytes, end - kLocatorSize + 8, 8);
    if (record < end && end - record >= kLongEndSize && bytes.substr(record, kLongEndMark.size()) == kLongEndMark)
      return {number_at(bytes, record + 48, 8), number_at(bytes, record + 32, 8)};
  }
  return {number_at(bytes, end + 16, 4), number_at(bytes, end + 10, 2)};
}

void append(std::string& bytes, std::size_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 255);
}

std::size_t checksum_of(std::string_view bytes) {
  return crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
}

/// Ends a stream of zlib however the work ends.
struct Stream {
  z_stream stream{};
  int (*end)(z_streamp);
  ~Stream() { end(&stream); }
};

}  // namespace

ZipArchive::ZipArchive(std::string name, std::string_view bytes) : name_(std::move(name)), bytes_(bytes) {
  const auto fail = [&](const char* what) { throw InputError(name_ + ": " + what); };
  const std::size_t end = bytes.rfind(kEndMark);  // a comment of up to 64 kB follows the end
  if (end == std::string_view::npos || bytes.size() - end < kEndSize) fail("no ZIP archive: its end is missing");
  const Directory directory = directory_of(bytes, end);
  std::size_t at = directory.begin, packed_bytes = 0;
  for (std::size_t i = 0; i < directory.count; ++i) {
    if (at > end || end - at < kDirectoryEntrySize || bytes.substr(at, 4) != kDirectoryMark)
      fail("the directory of the ZIP archive is damaged");
    const std::size_t name_size = number_at(bytes, at + 28, 2), extra = number_at(bytes, at + 30, 2),
                      comment = number_at(bytes, at + 32, 2);
    const std::size_t size = kDirectoryEntrySize + name_size + extra + comment;
    if (size > end - at) fail("the directory of the ZIP archive is damaged");
    if (number_at(bytes, at + 8, 2) & 1) fail("the ZIP archive is encrypted");
    Entry entry{number_at(bytes, at + 10, 2), number_at(bytes, at + 16, 4), number_at(bytes, at + 20, 4),
                number_at(bytes, at + 24, 4), number_at(bytes, at + 42, 4)};
    if (!read_long_values(bytes.substr(at + kDirectoryEntrySize + name_size, extra),
                          {&entry.size, &entry.packed_size, &entry.header}))
      fail("the directory of the ZIP archive is damaged");
    // A few bytes that many entries share could stand for any amount of data.
    if (entry.packed_size > bytes.size() - packed_bytes) fail("the entries of the ZIP archive overlap");
    packed_bytes += entry.packed_size;
    entries_[std::string(bytes.substr(at + kDirectoryEntrySize, name_size))] = entry;
    at += size;
  }
}

std::string ZipArchive::read(const std::string& path) const {
  const auto fail = [&](const std::string& what) { throw InputError(name_ + ": " + path + ": " + what); };
  const auto found = entries_.find(path);
  if (found == entries_.end()) fail("is not in the archive");
  const Entry& entry = found->second;
  if (entry.header > bytes_.size() || bytes_.size() - entry.header < kHeaderSize ||
      bytes_.substr(entry.header, 4) != kHeaderMark)
    fail("its header is damaged");
  const std::size_t begin =
      entry.header + kHeaderSize + number_at(bytes_, entry.header + 26, 2) + number_at(bytes_, entry.header + 28, 2);
  if (begin > bytes_.size() || entry.packed_size > bytes_.size() - begin) fail("is cut short");
  const std::string_view packed = bytes_.substr(begin, entry.packed_size);
  constexpr std::size_t kMostRatio = 1032;  // of zlib
  if (entry.method != kStored && entry.method != kDeflated) fail("is packed in an unknown way");
  if (entry.size > (entry.method == kStored ? packed.size() : packed.size() * kMostRatio))
    fail("claims to be larger than its packed bytes can be");
  if (std::max(entry.size, entry.packed_size) > std::numeric_limits<uInt>::max()) fail("is larger than 4 GB");
  std::string content;
  if (entry.method == kStored) {
    content = std::string(packed.substr(0, entry.size));
  } else {
    content.resize(entry.size);
    Stream inflater{{}, inflateEnd};
    if (inflateInit2(&inflater.stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
    inflater.stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    inflater.stream.avail_in = static_cast<uInt>(packed.size());
    inflater.stream.next_out = reinterpret_cast<Bytef*>(content.data());
    inflater.stream.avail_out = static_cast<uInt>(content.size());
    if (inflate(&inflater.stream, Z_FINISH) != Z_STREAM_END || inflater.stream.avail_out != 0) fail("is damaged");
  }
  if (checksum_of(content) != entry.checksum) fail("is damaged: its checksum is wrong");
  return content;
}

void ZipWriter::add(const std::string& path, std::string_view content) {
  constexpr std::size_t kMostZipBytes = std::numeric_limits<std::uint32_t>::max();
  if (content.size() > kMostZipBytes / 2 || bytes_.size() > kMostZipBytes / 2)
    throw InputError(path + ": more than 2 GB, which a ZIP archive cannot hold");
  Stream deflater{{}, deflateEnd};
  if (deflateInit2(&deflater.stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string packed(deflateBound(&deflater.stream, content.size()), '\0');
  deflater.stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  deflater.stream.avail_in = static_cast<uInt>(content.size());
  deflater.stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  deflater.stream.avail_out = static_cast<uInt>(packed.size());
  if (deflate(&deflater.stream, Z_FINISH) != Z_STREAM_END) throw std::bad_alloc();
  packed.resize(packed.size() - deflater.stream.avail_out);
  std::string common;  // of the header and of the entry in the directory
  constexpr std::size_t kZipVersion = 20, kFirstOf1980 = 0x21;
  append(common, kZipVersion, 2);
  append(common, 0, 2);  // flags
  append(common, kDeflated, 2);
  append(common, 0, 2);  // time
  append(common, kFirstOf1980, 2);
  append(common, checksum_of(content), 4);
  append(common, packed.size(), 4);
  append(common, content.size(), 4);
  append(common, path.size(), 2);
  append(common, 0, 2);  // extra
  directory_ += kDirectoryMark;
  append(directory_, kZipVersion, 2);
  directory_ += common;
  directory_ += std::string(10, '\0');  // comment, disk, attributes
  append(directory_, bytes_.size(), 4);
  directory_ += path;
  (bytes_ += kHeaderMark) += common;
  (bytes_ += path) += packed;
  ++count_;
}

std::string ZipWriter::take() {
  const std::size_t begin = bytes_.size();
  bytes_ += directory_;
  bytes_ += kEndMark;
  append(bytes_, 0, 4);
  append(bytes_, count_, 2);
  append(bytes_, count_, 2);
  append(bytes_, directory_.size(), 4);
  append(bytes_, begin, 4);
  append(bytes_, 0, 2);
  return std::move(bytes_);
}

}  // namespace subvol::internal
