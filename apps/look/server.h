#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "apps/look/engine.h"
#include "apps/look/exports.h"
#include "apps/look/jobs.h"
#include "apps/look/settings.h"
#include "apps/look/subject.h"

namespace httplib {
class Server;
struct Request;
struct Response;
}  // namespace httplib

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
  std::string version;
};

/// The web page of the viewer and what it asks for; docs/look.md describes the protocol.
///
/// Every address begins with a random word, and requests must name the host that it listens on, so that no
/// other page of the browser can reach it.
class LookServer {
 public:
  /// Listens from here on. @throws Error if no port from `port` on is free.
  explicit LookServer(const LookServerOptions& options);
  /// Says farewell to all pages and ends all work.
  ~LookServer();
  LookServer(const LookServer&) = delete;
  LookServer& operator=(const LookServer&) = delete;

  /// "http://127.0.0.1:8080/WORD/"
  const std::string& address() const { return address_; }
  int port() const { return port_; }
  /// Files that pictures are made of have changed.
  void changed(const std::vector<std::string>& paths);
  /// Files that pictures are made of.
  std::vector<std::string> watched() const;

 private:
  using Handler = nlohmann::json (LookServer::*)(const nlohmann::json&);

  void route();
  void answer(const std::string& name, Handler handler);
  bool isFromHere(const httplib::Request& request) const;
  void stream(const httplib::Request& request, httplib::Response& response);
  nlohmann::json controls() const;
  LookExports exportsOf(const nlohmann::json& body) const;
  nlohmann::json setSettings(const nlohmann::json& body);
  nlohmann::json makeWedge(const nlohmann::json& body);
  nlohmann::json commandLines(const nlohmann::json& body);
  nlohmann::json recipe(const nlohmann::json& body);
  nlohmann::json saveLook(const nlohmann::json& body);
  nlohmann::json startJob(const nlohmann::json& body);
  nlohmann::json stopJob(const nlohmann::json& body);

  LookServerOptions options_;
  std::string word_, address_;
  int port_ = 0;
  LookEngine engine_;
  LookJobs jobs_;
  // The last request of each page, to be made again where files change.
  std::mutex mutex_;
  std::map<std::string, LookRequest> latest_;
  std::unique_ptr<httplib::Server> server_;
  std::thread thread_;
};

}  // namespace nephele::apps
