#include <CLI/CLI.hpp>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "console.h"
#include "core/memory_limit.h"
#include "front.h"
#include "job/messages.h"
#include "program.h"

namespace bisector::cli {
namespace {

int fail_usage(const std::string& message, const Command* command) {
  const std::string help = command ? "bisector " + command->app->get_name() + " --help" : "bisector --help";
  print_error(message + "; see " + help);
  return command && command->failure ? command->failure : kUsage;
}

void print_no_memory() {
  const std::uint64_t limit = memory_limit();
  if (limit == 0) return print_error(job::kNoMemory);
  print_error("not enough memory: the limit is " + std::to_string(limit >> 20) +
              " MiB; raise it (--memory), ask for fewer vertices or use a larger machine");
}

void print_no_thread() {
  const std::uint64_t limit = memory_limit();
  if (limit == 0) return print_error(job::kNoThread);
  print_error("the system refuses another thread: the limit of memory is " + std::to_string(limit >> 20) +
              " MiB; raise it (--memory), or give fewer --threads");
}

// Runs the command and maps what it throws to an exit code.
int run_guarded(const Command& command) {
  try {
    command.run();
    return kSuccess;
  } catch (const Cancelled&) {
    print_cancelled();
    return kInterrupted;
  } catch (const JobsFailed& error) {
    print_error(error.what());
    return static_cast<int>(std::min<std::size_t>(error.jobs, kMostJobs));
  } catch (const std::bad_alloc&) {
    print_no_memory();
  } catch (const Error& error) {
    print_error(job::with_advice(error));
  } catch (const std::exception& error) {
    if (job::wants_thread(error)) print_no_thread();
    else print_error(error.what());
  }
  return command.failure ? command.failure : kFailure;
}

}  // namespace

int run_program(int argc, char** argv) {
  Program program = make_program();
  CLI::App& app = *program.app;
  const std::vector<Command>& commands = program.commands;
  const auto chosen = [&]() -> const Command* {
    const auto found = std::find_if(commands.begin(), commands.end(), [](const Command& c) { return c.app->parsed(); });
    return found == commands.end() ? nullptr : &*found;
  };

  set_arguments(argc, argv);
  try {
    app.parse(argc, argv);
    if (chosen() && chosen()->check_usage) chosen()->check_usage();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      app.exit(error);
      if (std::cout.flush()) return kSuccess;
      print_error("what is printed cannot be written to stdout; check where it is redirected to");
      return kFailure;
    }
    return fail_usage(error.what(), chosen());
  }
  if (!chosen()) {
    std::fputs(app.help().c_str(), stdout);
    return fail_usage("no command given", nullptr);
  }

  watch_interrupts();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error like a full disk
  return run_guarded(*chosen());
}

}  // namespace bisector::cli
