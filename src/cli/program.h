// The command line of the program, with all of its commands: for the program itself and for its manual.
#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <vector>

#include "commands.h"

namespace bisector::cli {

// Exit codes, part of the program's contract.
inline constexpr int kSuccess = 0;
inline constexpr int kFailure = 1;
inline constexpr int kUsage = 2;
inline constexpr int kInterrupted = 130;

struct ExitCode {
  int code;
  const char* meaning;
};
inline constexpr ExitCode kExitCodes[] = {
    {kSuccess, "success"}, {kFailure, "bad input or a failed run"}, {kUsage, "bad usage"}, {kInterrupted, "cancelled"}};

struct Program {
  std::unique_ptr<CLI::App> app;
  CommandText text;
  std::vector<Command> commands;  // in the order of the help
};

Program make_program();

// All of the program: reads the command line, runs the command, tells what it throws. Returns the exit code.
int run_program(int argc, char** argv);

}  // namespace bisector::cli
