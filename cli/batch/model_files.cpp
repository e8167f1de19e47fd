// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/model_files.h"

#include "subvol/base/fingerprint.h"

#include <chrono>
#include <fstream>
#include <optional>
#include <span>
#include <system_error>

#include <sys/stat.h>

namespace subvol::cli {

using namespace internal;
namespace {

namespace fs = std::filesystem;

/// A file whose last change is younger than this may change again without another time: file systems count in steps of
/// up to 2 s.
constexpr std::int64_t kYoungNanoseconds = 2'000'000'000;

struct FileState {
  std::uint64_t size = 0;
  std::int64_t changed = 0;  ///< nanoseconds since 1970
};

std::optional<FileState> regular_file_state(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return {};
  return FileState{static_cast<std::uint64_t>(status.st_size),
                   status.st_mtim.tv_sec * 1'000'000'000LL + status.st_mtim.tv_nsec};
}

/// The part of a word that may name a file: what stands behind "--option=", or the whole word if it is no option.
std::string_view value_of(std::string_view word) {
  if (!word.starts_with('-')) return word;
  const std::size_t sign = word.find('=');
  return sign == std::string_view::npos ? std::string_view{} : word.substr(sign + 1);
}

/// Calls use(word, path, state, is_input) for each file of a model.
template <class Use>
void for_each_file(const BatchModel& model, const fs::path& folder, const Use& use) {
  const fs::path input = folder / model.input;
  use(std::string_view(model.input), input, regular_file_state(input), true);
  for (const std::string& word : model.options) {
    const std::string_view value = value_of(word);
    if (value.empty()) continue;
    const fs::path path = folder / value;
    if (const auto state = regular_file_state(path)) use(value, path, state, false);
  }
}

std::uint64_t content_hash(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  Fingerprint hash;
  static thread_local std::vector<char> block(std::size_t{1} << 20);
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())) || file.gcount() > 0)
    hash.add(std::span<const char>(block.data(), static_cast<std::size_t>(file.gcount())));
  return hash.value();
}

std::int64_t now_nanoseconds() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

constexpr std::uint64_t kMissing = 0;  ///< stands for the content of a file that cannot be read

}  // namespace

ModelFiles FileHasher::hash(const BatchModel& model) {
  Fingerprint contents, stamps;
  const std::int64_t young = now_nanoseconds() - kYoungNanoseconds;
  bool is_certain = true;
  for_each_file(model, folders_[model.folder],
                [&](std::string_view word, const fs::path& path, const std::optional<FileState>& state, bool is_input) {
                  stamps.add(word);
                  if (!state) {
                    contents.add(kMissing);
                    stamps.add(kMissing);
                    return;
                  }
                  stamps.add(state->size).add(state->changed);
                  is_certain = is_certain && state->changed < young;
                  if (is_input) {
                    contents.add(content_hash(path));
                    return;
                  }
                  Content& known = shared_[path.string()];
                  if (known.size != state->size || known.changed != state->changed)
                    known = {state->size, state->changed, content_hash(path)};
                  contents.add(known.hash);
                });
  return {contents.text(), is_certain ? stamps.text() : std::string()};
}

std::string FileHasher::stamp(const BatchModel& model) const {
  Fingerprint stamps;
  for_each_file(model, folders_[model.folder],
                [&](std::string_view word, const fs::path&, const std::optional<FileState>& state, bool) {
                  stamps.add(word);
                  if (state)
                    stamps.add(state->size).add(state->changed);
                  else
                    stamps.add(kMissing);
                });
  return stamps.text();
}

std::string FileHasher::absolute(const BatchModel& model, const std::string& word) const {
  const std::string_view value = value_of(word);
  if (value.empty()) return word;
  const fs::path path = folders_[model.folder] / value;
  if (value != model.input && !regular_file_state(path)) return word;
  return word.substr(0, word.size() - value.size()) + fs::absolute(path).lexically_normal().string();
}

}  // namespace subvol::cli
