// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/latest_records.h"

#include "cli/batch/record.h"
#include "cli/batch/record_file.h"
#include "subvol/base/error.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace subvol::cli {

namespace fs = std::filesystem;

/// A file as bytes in memory.
class LatestRecords::Mapping {
 public:
  explicit Mapping(const fs::path& path) {
    const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat status {};
    if (file < 0 || fstat(file, &status) != 0) {
      const int error = errno;
      if (file >= 0) close(file);
      throw InputError(path.string() + ": cannot be read: " + std::strerror(error) +
                       "; expected the folder that 'subvol batch' has written to");
    }
    size_ = static_cast<std::size_t>(status.st_size);
    if (size_ > 0) bytes_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file, 0);
    close(file);
    if (bytes_ == MAP_FAILED) throw InputError(path.string() + ": cannot be read: " + std::strerror(errno));
  }
  ~Mapping() {
    if (size_ > 0 && bytes_ != MAP_FAILED) munmap(bytes_, size_);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  std::string_view bytes() const { return {static_cast<const char*>(bytes_), size_}; }

 private:
  void* bytes_ = nullptr;
  std::size_t size_ = 0;
};

LatestRecords::LatestRecords(std::span<const fs::path> folders) {
  for (std::size_t i = 0; i < folders.size(); ++i) {
    files_.push_back(std::make_unique<Mapping>(folders[i] / kRecordsName));
    std::string_view rest = files_.back()->bytes();
    // A last line without an end is being written, or was when the machine failed.
    for (std::size_t end; (end = rest.find('\n')) != std::string_view::npos; rest.remove_prefix(end + 1)) {
      const std::string_view line = rest.substr(0, end), id = quoted_id(line);
      if (!id.empty() && line.ends_with('}'))
        entries_[id] = {line, i};
      else if (!line.empty())
        ++num_damaged_;
    }
  }
}

LatestRecords::~LatestRecords() = default;

void LatestRecords::for_each(const std::function<void(const Entry&)>& use) const {
  std::vector<const std::pair<const std::string_view, Entry>*> sorted;
  sorted.reserve(entries_.size());
  for (const auto& entry : entries_) sorted.push_back(&entry);
  std::sort(sorted.begin(), sorted.end(), [](const auto* a, const auto* b) { return a->first < b->first; });
  for (const auto* entry : sorted) use(entry->second);
}

std::string_view LatestRecords::find(const std::string& id) const {
  const std::string quoted = Json(id).dump();
  const auto found = entries_.find(std::string_view(quoted).substr(1, quoted.size() - 2));
  return found == entries_.end() ? std::string_view() : found->second.line;
}

}  // namespace subvol::cli
