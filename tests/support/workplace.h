// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "samples/shapes.h"
#include "subvol/io/mesh_io.h"
#include "tests/support/data.h"
#include "tests/support/temporary_folder.h"

#include <nlohmann/json.hpp>

#include <cstdlib>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

// GCC says it with macros, Clang with features.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SUBVOL_IS_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SUBVOL_IS_SANITIZED 1
#endif
#endif

namespace subvol::test {

/// Whether the address or thread sanitizer is built in: its own memory leaves no sense to a limit on memory.
#ifdef SUBVOL_IS_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// Sets a variable of the environment while it lives.
class Environment {
 public:
  Environment(std::string name, const std::string& value) : name_(std::move(name)) {
    if (const char* before = std::getenv(name_.c_str())) before_ = before;
    setenv(name_.c_str(), value.c_str(), 1);
  }
  ~Environment() { before_ ? setenv(name_.c_str(), before_->c_str(), 1) : unsetenv(name_.c_str()); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::string name_;
  std::optional<std::string> before_;
};

/// How the program ended.
struct Run {
  int status = -1;
  std::string out, err;
};

/// The beginning of a fit of the sample of a `Workplace`.
inline const std::string kFit = "fit target.off --template template.mesh ";

inline bool has(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

/// A folder with one sample in it, in which the program is run.
class Workplace {
 public:
  explicit Workplace(const samples::Sample& sample = samples::ball_sample()) {
    folder_.file("target.off", samples::off_text(sample.target));
    write_volume_mesh(folder_ / "template.mesh", sample.template_mesh);
  }

  /// limit_kind, limit: of setrlimit, for the program alone; negative kind: none.
  pid_t start(const std::string& arguments, int limit_kind = -1, rlim_t limit = 0) const {
    std::vector<std::string> words{program()};
    std::istringstream stream(arguments);
    for (std::string word; stream >> word;) words.push_back(word);
    const pid_t child = fork();
    if (child != 0) return child;
    if (chdir(folder_.path().c_str()) != 0) _exit(99);
    redirect("stdout.txt", STDOUT_FILENO);
    redirect("stderr.txt", STDERR_FILENO);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    const rlimit both{limit, limit};
    if (limit_kind >= 0) setrlimit(static_cast<__rlimit_resource>(limit_kind), &both);
    argv.push_back(nullptr);
    execv(argv[0], argv.data());
    _exit(98);
  }

  Run finish(pid_t child) const {
    int status = 0;
    waitpid(child, &status, 0);
    // A shell's convention, so that a crash is no status of ours.
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), content_of(folder_ / "stdout.txt"),
            content_of(folder_ / "stderr.txt")};
  }

  Run run(const std::string& arguments, int limit_kind = -1, rlim_t limit = 0) const {
    return finish(start(arguments, limit_kind, limit));
  }

  std::filesystem::path operator/(const char* name) const { return folder_ / name; }
  std::filesystem::path file(const std::string& name, const std::string& text) const {
    return folder_.file(name, text);
  }
  bool has(const char* name) const { return std::filesystem::exists(folder_ / name); }
  nlohmann::json json(const char* name) const { return nlohmann::json::parse(content_of(folder_ / name)); }

  std::set<std::string> names() const {
    std::set<std::string> all;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      const std::string name = entry.path().filename().string();
      if (name != "stdout.txt" && name != "stderr.txt") all.insert(name);
    }
    return all;
  }

 private:
  static void redirect(const char* name, int descriptor) {
    const int file = open(name, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(file, descriptor);
  }

  TemporaryFolder folder_;
};

}  // namespace subvol::test
