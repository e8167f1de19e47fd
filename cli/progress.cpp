// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/progress.h"

#include "cli/run_options.h"

#include <algorithm>
#include <cstdio>
#include <iostream>

#include <unistd.h>

namespace subvol::cli {
namespace {

using Kind = ProgressTeller::Kind;
constexpr int kBarWidth = 30;
constexpr std::chrono::seconds kPlainInterval{10};
constexpr std::chrono::milliseconds kBarInterval{100};

Kind kind_of(const std::string& name, bool quiet) {
  if (name == "json") return Kind::json;
  if (quiet || name == "none") return Kind::none;
  // A bar in a file or a pipe would be one endless line.
  if (name != "plain" && isatty(STDERR_FILENO)) return Kind::bar;
  return Kind::plain;
}

double share_done(const FitProgress& progress) { return std::clamp(progress.fraction, 0.0, 1.0); }

std::string level_text(const FitProgress& progress) {
  return progress.level > 0 ? "level " + std::to_string(progress.level) + "  " : "";
}

}  // namespace

ProgressTeller::ProgressTeller(const std::string& name, bool quiet)
    : kind_(kind_of(name, quiet)), start_(Clock::now()), last_(start_) {}

ProgressTeller::~ProgressTeller() { finish(); }

void ProgressTeller::tell(const FitProgress& progress) {
  switch (kind_) {
    case Kind::bar: return draw_bar(progress);
    case Kind::plain: return write_line(progress);
    case Kind::json: return write_json(progress);
    case Kind::none: return;
  }
}

void ProgressTeller::finish() {
  if (bar_shown_) std::fputc('\n', stderr);
  bar_shown_ = false;
}

void ProgressTeller::draw_bar(const FitProgress& progress) {
  const auto now = Clock::now();
  if (bar_shown_ && now - last_ < kBarInterval) return;
  last_ = now;
  bar_shown_ = true;
  const int filled = static_cast<int>(share_done(progress) * kBarWidth);
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(kBarWidth - filled), '.');
  std::fprintf(stderr, "\r\033[K[%s] %3.0f%%  %s%.40s  step %d", bar.c_str(), 100 * share_done(progress),
               level_text(progress).c_str(), progress.stage, progress.iteration);
  std::fflush(stderr);
}

void ProgressTeller::write_line(const FitProgress& progress) {
  const auto now = Clock::now();
  const bool new_stage = last_stage_ != progress.stage || last_level_ != progress.level;
  if (!new_stage && now - last_ < kPlainInterval) return;
  last_ = now;
  last_stage_ = progress.stage;
  last_level_ = progress.level;
  std::fprintf(stderr, "%3.0f%%  %6.1f s  %s%s  step %d  energy %.4g\n", 100 * share_done(progress),
               std::chrono::duration<double>(now - start_).count(), level_text(progress).c_str(), progress.stage,
               progress.iteration, progress.energy);
}

void ProgressTeller::write_json(const FitProgress& progress) {
  const Json line{{"stage", progress.stage},     {"level", progress.level},
                  {"iteration", progress.iteration}, {"energy", progress.energy},
                  {"fraction", share_done(progress)}, {"seconds", std::chrono::duration<double>(Clock::now() - start_).count()}};
  std::cout << line.dump() << std::endl;
}

}  // namespace subvol::cli
