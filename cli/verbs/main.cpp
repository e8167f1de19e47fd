// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/report.h"
#include "cli/runs/standard_output.h"
#include "cli/verbs/commands.h"
#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <unistd.h>

namespace subvol::cli {
namespace {

int complain(const char* what, int status) {
  std::cerr << "subvol: " << what << '\n';
  return status;
}

// Names the unknown verb: the parser would only say that a verb is missing.
void require_known_verb(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-' || std::string_view(argv[1]) == "help") return;
  std::string verbs;
  for (const CLI::App* verb : app.get_subcommands({})) {
    if (verb->get_name() == argv[1]) return;
    verbs += ' ' + verb->get_name();
  }
  throw UsageError(std::string("there is no verb '") + argv[1] + "'; there are:" + verbs);
}

/// Number of characters to insert, drop or replace to turn one word into the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

/// Refuses an option that neither the verb nor the program has. The parser would first complain about arguments that
/// are missing.
void require_known_options(const CLI::App& app, int argc, char** argv) {
  const CLI::App* verb = &app;
  std::string name = "subvol";
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--") return;
    if (!word.starts_with("--")) {
      const auto parts = verb->get_subcommands([&](const CLI::App* part) { return part->get_name() == word; });
      if (parts.empty()) continue;
      verb = parts.front();
      name += ' ' + std::string(word);
      continue;
    }
    const std::string option(word.substr(0, word.find('=')));
    std::string nearest;
    std::size_t least = 3;  // edits: more is another word
    bool is_known = false;
    for (const CLI::App* level = verb; level != nullptr; level = level->get_parent())
      for (const CLI::Option* known : level->get_options())
        for (const std::string& long_name : known->get_lnames()) {
          const std::string spelled = "--" + long_name;
          is_known = is_known || spelled == option;
          if (const std::size_t edits = edit_distance(option, spelled); edits < least) least = edits, nearest = spelled;
        }
    if (is_known) continue;
    throw UsageError(name + ": there is no option '" + option + "'" +
                     (nearest.empty() ? "; " + name + " --help lists them" : "; did you mean " + nearest + "?"));
  }
}

/// `subvol help fit` is `subvol fit --help`.
std::vector<std::string> arguments_of(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (!words.empty() && words[0] == "help") {
    words.erase(words.begin());
    words.push_back("--help");
  }
  return words;
}

/// True if an allocation has failed.
std::atomic<bool> has_run_out{false};

[[noreturn]] void run_out() {
  has_run_out = true;
  throw std::bad_alloc();
}

/// Ends the program in order if an exception leaves a parallel loop, so that nothing is left half-written. In the
/// program's first thread the language does not say which exception it was.
[[noreturn]] void end_in_order() {
  const char* what = has_run_out ? kOutOfMemory : "an error in a parallel loop";
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {  // thrown by Eigen, which allocates in another way
    what = kOutOfMemory;
  } catch (...) {
  }
  // Nothing is allocated any more and nothing is unwound: other threads are still running.
  delete_temporaries();
  (void)!write(STDERR_FILENO, "subvol: ", 8);
  (void)!write(STDERR_FILENO, what, std::strlen(what));
  (void)!write(STDERR_FILENO, "\n", 1);
  std::_Exit(kFailed);
}

/// Keeps freed memory in the process: a step allocates the arrays of the previous one again, and the system would have
/// to clear their pages each time (a tenth of the time of `optimize`).
void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int kMegabyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMegabyte);
  mallopt(M_TRIM_THRESHOLD, 128 * kMegabyte);
#endif
}

/// Refuses `--report=`, which would take the next word as its value.
void require_value_behind_sign(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word.starts_with("--") && word.find('=') == word.size() - 1)
      throw UsageError(std::string(word.substr(0, word.size() - 1)) + ": expected a value, got nothing");
  }
}

/// Refuses empty values: an unset variable of a script is not a file name, and its option would otherwise count as not
/// given.
void require_values(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& value : option->results())
      if (value.empty()) throw UsageError(option->get_name() + ": expected a value, got nothing");
  for (const CLI::App* verb : app.get_subcommands()) require_values(*verb);
}

int run(int argc, char** argv) {
  remember_command_line(argc, argv);
  CLI::App app{"Fits volume meshes to surfaces: subdivision volumes and shells.", "subvol"};
  Action action;
  describe_program(app, action);
  require_known_verb(app, argc, argv);
  require_value_behind_sign(argc, argv);
  require_known_options(app, argc, argv);
  try {
    std::vector<std::string> words = arguments_of(argc, argv);
    std::reverse(words.begin(), words.end());  // the parser takes the last one first
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  require_values(app);
  return action();
}

/// Returns the result of `run`, or the status of the error that it ends with.
int run_to_status(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const UsageError& error) {
    return complain(error.what(), kUsage);
  } catch (const EndedEarly& error) {
    return complain(error.what(), error.status);
  } catch (const InputError& error) {
    return complain(error.what(), kRejected);
  } catch (const std::bad_alloc&) {
    return complain(kOutOfMemory, kFailed);
  } catch (const std::exception& error) {
    return complain(error.what(), kFailed);
  }
}

}  // namespace
}  // namespace subvol::cli

int main(int argc, char** argv) {
  using namespace subvol::cli;
  keep_freed_memory();
  std::set_new_handler(run_out);
  std::set_terminate(end_in_order);
  std::signal(SIGXFSZ, SIG_IGN);  // reaching the limit on file sizes becomes a write error, like a full disk
  subvol::cli::end_on_interrupt();
  prepare_standard_output();
  return finished_standard_output(run_to_status(argc, argv));
}
