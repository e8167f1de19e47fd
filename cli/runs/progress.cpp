// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/progress.h"

#include "cli/runs/run_options.h"
#include "cli/runs/standard_output.h"
#include "subvol/base/format.h"

#include <algorithm>
#include <cstdio>

#include <unistd.h>

namespace subvol::cli {

using namespace internal;
namespace {

using Kind = ProgressTeller::Kind;
constexpr int kBarWidth = 30;
constexpr std::chrono::seconds kPlainInterval{10}, kWorkInterval{1};
constexpr double kTellingShare = 0.05;
/// Share of a run that its fit takes; the rest is for measuring and writing the result.
constexpr double kFitShare = 0.9;
constexpr std::chrono::milliseconds kBarInterval{100};

Kind kind_of(const std::string& name, bool quiet) {
  if (name == "json") return Kind::json;
  if (quiet || name == "none") return Kind::none;
  // In a file or a pipe a bar would be one endless line.
  if (name != "plain" && isatty(STDERR_FILENO)) return Kind::bar;
  return Kind::plain;
}

double share_done(const FitProgress& progress) { return kFitShare * std::clamp(progress.fraction, 0.0, 1.0); }

std::string level_text(const FitProgress& progress) {
  return progress.level > 0 ? "level " + std::to_string(progress.level) + "  " : "";
}

/// An estimated time, with few digits.
std::string left_text(double seconds) {
  if (seconds < 0) return "";
  if (seconds < 90) return formatted("  %.0f s left", seconds);
  return seconds < 5400 ? formatted("  %.0f min left", seconds / 60) : formatted("  %.1f h left", seconds / 3600);
}

}  // namespace

ProgressTeller::ProgressTeller(const std::string& name, bool quiet)
    : kind_(kind_of(name, quiet)), start_(Clock::now()), last_(start_) {}

ProgressTeller::~ProgressTeller() { finish(); }

void ProgressTeller::tell(const FitProgress& progress) {
  has_fit_ = true;
  switch (kind_) {
    case Kind::bar:
      return draw_bar(share_done(progress), level_text(progress) + formatted("%.40s", progress.stage) + "  step " +
                                                std::to_string(progress.iteration));
    case Kind::plain: return write_line(progress);
    case Kind::json: return write_json(progress);
    case Kind::none: return;
  }
}

void ProgressTeller::tell_work(const char* part, double share_of_work) {
  const double share = has_fit_ ? kFitShare + (1 - kFitShare) * share_of_work : share_of_work;
  if (kind_ == Kind::bar) return draw_bar(share, part);
  if (kind_ == Kind::json) print(Json{{"part", part}, {"share", share_of_work}, {"seconds", seconds()}}.dump() + '\n');
  const auto now = Clock::now();
  if (kind_ != Kind::plain || now - last_ < kWorkInterval) return;
  last_ = now;
  std::fprintf(stderr, "%3.0f%%  %6.1f s  %s\n", 100 * share, seconds(), part);
}

void ProgressTeller::tell_count(std::size_t done, std::size_t total, const std::string& words) {
  const double share = total > 0 ? static_cast<double>(done) / static_cast<double>(total) : 1;
  const std::string text = std::to_string(done) + " of " + std::to_string(total) + "  " + words;
  if (kind_ == Kind::bar) return draw_bar(share, text);
  const double left = seconds_left(share);
  if (kind_ == Kind::json) {
    Json line{{"done", done}, {"total", total}, {"seconds", seconds()}};
    if (left >= 0) line["seconds_left"] = left;
    return print(line.dump() + '\n');
  }
  const auto now = Clock::now();
  if (kind_ != Kind::plain || (now - last_ < kPlainInterval && done < total)) return;
  last_ = now;
  std::fprintf(stderr, "%3.0f%%  %6.1f s%s  %s\n", 100 * share, seconds(), left_text(left).c_str(), text.c_str());
}

void ProgressTeller::finish() {
  if (bar_shown_) std::fputc('\n', stderr);
  bar_shown_ = false;
}

double ProgressTeller::seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

double ProgressTeller::seconds_left(double share) {
  if (share != last_share_) total_seconds_ = share < kTellingShare ? 0 : seconds() / share;
  last_share_ = share;
  return total_seconds_ - seconds();
}

void ProgressTeller::draw_bar(double share, const std::string& words) {
  const auto now = Clock::now();
  if (bar_shown_ && now - last_ < kBarInterval) return;
  last_ = now;
  bar_shown_ = true;
  const int filled = static_cast<int>(share * kBarWidth);
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(kBarWidth - filled), '.');
  std::fprintf(stderr, "\r\033[K[%s] %3.0f%%%s  %s", bar.c_str(), 100 * share, left_text(seconds_left(share)).c_str(),
               words.c_str());
  std::fflush(stderr);
}

void ProgressTeller::write_line(const FitProgress& progress) {
  const auto now = Clock::now();
  const bool new_stage = last_stage_ != progress.stage || last_level_ != progress.level;
  if (!new_stage && now - last_ < kPlainInterval) return;
  last_ = now;
  last_stage_ = progress.stage;
  last_level_ = progress.level;
  const double share = share_done(progress);
  std::fprintf(stderr, "%3.0f%%  %6.1f s%s  %s%s  step %d  energy %.4g\n", 100 * share, seconds(),
               left_text(seconds_left(share)).c_str(), level_text(progress).c_str(), progress.stage, progress.iteration,
               progress.energy);
}

void ProgressTeller::write_json(const FitProgress& progress) {
  Json line{{"stage", progress.stage},   {"level", progress.level},          {"iteration", progress.iteration},
            {"energy", progress.energy}, {"fraction", share_done(progress)}, {"seconds", seconds()}};
  if (const double left = seconds_left(share_done(progress)); left >= 0) line["seconds_left"] = left;
  print(line.dump() + '\n');
}

}  // namespace subvol::cli
