// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/work.h"

#include "cli/runs/run_options.h"
#include "subvol/base/option_checks.h"

#include <omp.h>

namespace subvol::python {

using namespace internal;

Work::Work(Keywords& keywords) : callback_(keywords.object("progress")) {
  if (!callback_.is_none() && !PyCallable_Check(callback_.ptr()))
    throw py::type_error("progress must be callable, not " + py::repr(callback_).cast<std::string>());
  std::optional<int> threads;
  keywords.take("threads", threads);
  if (!threads) return;
  require_in_range("options", "threads", *threads, 1, 1024);
  threads_ = *threads;
}

Work::ThreadCount::ThreadCount(int threads) : before_(omp_get_max_threads()) {
  if (threads > 0) omp_set_num_threads(threads);
}

Work::ThreadCount::~ThreadCount() { omp_set_num_threads(before_); }

bool Work::tell(const FitProgress& progress) {
  if (error_) return false;
  const py::gil_scoped_acquire locked;
  try {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (callback_.is_none()) return true;
    const Progress told{progress.stage, progress.level, progress.iteration, progress.energy, progress.fraction};
    return truth_of(callback_(told)).value_or(true);
  } catch (py::error_already_set& error) {
    error_.emplace(std::move(error));
    return false;
  }
}

std::function<bool()> Work::cancelled() {
  return [this, asked = Clock::now()]() mutable {
    if (error_) return true;
    if (Clock::now() - asked < std::chrono::milliseconds(100)) return false;
    asked = Clock::now();
    const py::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() == 0) return false;
    error_.emplace();
    return true;
  };
}

void Work::raise_pending() {
  if (error_) throw py::error_already_set(*error_);
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void warn(const std::vector<std::string>& texts) {
  for (const std::string& text : texts)
    if (PyErr_WarnEx(PyExc_UserWarning, cli::as_utf8(in_keywords(text)).c_str(), 1) != 0) throw py::error_already_set();
}

}  // namespace subvol::python
