// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>

namespace subvol::internal {

/// Share of a long work that is done, from work that is counted against a forecast. It never falls, grows with all that
/// is counted, and stays below 1 however much more than the forecast that is.
class WorkShare {
 public:
  WorkShare() = default;
  /// A work of which this share is done.
  explicit WorkShare(double done) : begin_(done), end_(done) {}

  /// Begins a part, at whose end the share will be `end`; if that much is done already, a tenth of what is left. The
  /// part before is over, whatever its forecast was.
  /// forecast  work that the part is expected to take, > 0, in any unit.
  void begin_part(double end, double forecast) {
    constexpr double kOverduePartShare = 0.1;  // of the work that is left, for a part whose end is passed already
    begin_ = end_;
    end_ = end > begin_ ? std::min(end, 1.0) : begin_ + kOverduePartShare * (1 - begin_);
    forecast_ = forecast;
    done_ = 0;
  }
  /// Begins a part that ends at this portion, in (0, 1], of what is left up to `last`.
  void begin_portion(double portion, double last, double forecast) {
    begin_part(end_ + portion * (last - end_), forecast);
  }
  /// Counts work >= 0, in the unit of the forecast.
  void add(double work) { done_ += work; }
  /// Sets the share of the part that is done, >= 0, in place of counted work.
  void set(double share_of_part) { done_ = std::max(done_, share_of_part * forecast_); }

  /// Returns the share at the end of the present part.
  double share_at_end() const { return end_; }
  double share() const {
    constexpr double kTrustedShare = 0.8;  // from here on, the part's end is approached and never reached
    const double done = done_ / forecast_, rest = 1 - kTrustedShare;
    const double eased = done < kTrustedShare ? done : 1 - rest * std::exp(-(done - kTrustedShare) / rest);
    return begin_ + eased * (end_ - begin_);
  }

 private:
  double begin_ = 0, end_ = 0;  ///< shares at the ends of the part
  double forecast_ = 1, done_ = 0;
};

}  // namespace subvol::internal
