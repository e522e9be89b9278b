#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/look/settings.h"
#include "apps/look/subject.h"

namespace nephele::apps {

struct LookServerOptions {
  LookSubject subject;
  /// What is shown first.
  LookShow::What what = LookShow::What::cloud;
  /// What was given on the command line.
  LookSettings settings;
  /// Where to listen: a name or address of this machine.
  std::string host = "127.0.0.1";
  /// Where it is taken, the next one that is free.
  int port = 8080;
  /// Where files are written.
  std::string folder = ".";
  double memoryLimitBytes = 0;
  /// Options of the program that hold for the files that the page asks for, too: --memory-limit, --threads.
  std::vector<std::string> limits;
  std::string version;
};

/// The web page of the viewer and what it asks for; docs/look.md describes the protocol.
///
/// Every address begins with a random word, and requests must name the host that it listens on, so that no
/// other page of the browser can reach it.
class LookServer {
 public:
  /// Says farewell to all pages and ends all work.
  virtual ~LookServer() = default;

  /// "http://127.0.0.1:8080/WORD/"
  virtual const std::string& address() const = 0;
  virtual int port() const = 0;
  /// Files that pictures are made of have changed.
  virtual void changed(const std::vector<std::string>& paths) = 0;
  /// Files that pictures are made of.
  virtual std::vector<std::string> watched() const = 0;
};

/// Listens from here on. @throws Error if no port from `port` on is free.
///
/// Of the program, a module has it (module.cpp) that is loaded when it is first called (loader.cpp), as the
/// library that speaks HTTP takes a sixth of the time in which the program starts.
std::unique_ptr<LookServer> makeLookServer(const LookServerOptions& options);

}  // namespace nephele::apps
