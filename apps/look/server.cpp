#include "apps/look/server.h"

#include <fmt/format.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/random.h>
#include <sys/socket.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "apps/file_hashes.h"
#include "apps/look/controls.h"
#include "apps/look/engine.h"
#include "apps/look/exports.h"
#include "apps/look/jobs.h"
#include "apps/look/page_files.inc"
#include "apps/look/requests.h"

namespace nephele::apps {
namespace {

// Of requests; pictures go the other way.
constexpr std::size_t kMostBytes = 1 << 20;
constexpr int kMostThreads = 32, kMostPorts = 100;
// Of what a page says; JSON is copied by functions that call themselves.
constexpr int kMostDepth = 32;

std::string randomWord() {
  constexpr char kLetters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ012345678901";
  unsigned char bytes[22];
  require(getrandom(bytes, sizeof(bytes), 0) == sizeof(bytes), "no random numbers from the system");
  std::string word;
  for (const unsigned char byte : bytes) word += kLetters[byte & 63];
  return word;
}

nlohmann::json errorOf(const std::exception& error) {
  nlohmann::json one = {{"verb", ""}, {"option", ""}, {"message", error.what()}};
  if (const auto* fault = dynamic_cast<const LookFault*>(&error)) {
    one["verb"] = fault->verb();
    one["option"] = fault->option();
  }
  return {{"errors", {one}}};
}

nlohmann::json bodyOf(const std::string& text) {
  const auto keep = [](int depth, nlohmann::json::parse_event_t, const nlohmann::json&) {
    if (depth > kMostDepth) throw LookFault("", fmt::format("the body nests more than {} deep", kMostDepth));
    return true;
  };
  nlohmann::json body = nlohmann::json::parse(text, keep, false);
  if (!body.is_object()) throw LookFault("", "the body must be a JSON object");
  return body;
}

/// Names of files may be in any encoding, but JSON is UTF-8.
void sendJson(const nlohmann::json& value, httplib::Response& response) {
  response.set_content(value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
                       "application/json");
}

/// Ends all connections to a port of this process; the server would wait for them to say something.
void endConnections(int port) {
  constexpr int kMostSockets = 1024;
  for (int socket = 0; socket < kMostSockets; ++socket) {
    sockaddr_storage own{};
    socklen_t size = sizeof(own);
    if (getsockname(socket, reinterpret_cast<sockaddr*>(&own), &size) != 0) continue;
    const in_port_t its = own.ss_family == AF_INET    ? reinterpret_cast<const sockaddr_in&>(own).sin_port
                          : own.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(own).sin6_port
                                                      : in_port_t(0);
    if (ntohs(its) == port) shutdown(socket, SHUT_RDWR);
  }
}

const char* typeOfFile(const std::string& name) {
  if (name.ends_with(".js")) return "text/javascript; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  if (name.ends_with(".svg")) return "image/svg+xml";
  if (name.ends_with(".jpg")) return "image/jpeg";
  return "text/html; charset=utf-8";
}

/// A file of the page, or 404.
void sendFile(const std::string& name, httplib::Response& response) {
  for (const PageFile& file : kPageFiles)
    if (file.name == name)
      return response.set_content(file.bytes.data(), file.bytes.size(), typeOfFile(name));
  response.status = 404;
}

class HttpServer final : public LookServer {
 public:
  explicit HttpServer(const LookServerOptions& options);
  ~HttpServer() override;
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  const std::string& address() const override { return address_; }
  int port() const override { return port_; }
  void changed(const std::vector<std::string>& paths) override;
  std::vector<std::string> watched() const override;

 private:
  using Handler = nlohmann::json (HttpServer::*)(const nlohmann::json&);

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
  mutable std::mutex mutex_;
  std::map<std::string, LookRequest> latest_;
  httplib::Server server_;
  std::thread thread_;
};

HttpServer::HttpServer(const LookServerOptions& options)
    : options_(options),
      word_(randomWord()),
      engine_(options.memoryLimitBytes),
      jobs_([this](const nlohmann::json& message) { engine_.tell(message); }, options.limits) {
  server_.new_task_queue = [] { return new httplib::ThreadPool(kMostThreads); };
  server_.set_payload_max_length(kMostBytes);
  server_.set_read_timeout(5);
  server_.set_write_timeout(10);
  server_.set_keep_alive_timeout(30);
  server_.set_tcp_nodelay(true);
  // Its own choice would let two viewers share a port, and with it each other's pages.
  server_.set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  });
  route();
  if (httplib::Server().bind_to_any_port(options_.host) < 0)
    throw LookFault("", fmt::format("--host: got '{}', which is no address of this machine", options_.host));
  for (int i = 0; i < kMostPorts && port_ == 0 && options_.port + i <= 65535; ++i)
    if (server_.bind_to_port(options_.host, options_.port + i)) port_ = options_.port + i;
  if (port_ == 0)
    throw LookFault("", fmt::format("--port: none from {} on is free on {}", options_.port, options_.host));
  const bool isIpv6 = options_.host.find(':') != std::string::npos;
  address_ =
      fmt::format("http://{}:{}/{}/", isIpv6 ? "[" + options_.host + "]" : options_.host, port_, word_);
  thread_ = std::thread([this] { server_.listen_after_bind(); });
}

HttpServer::~HttpServer() {
  engine_.tell({{"type", "bye"}});
  engine_.closeAll();
  while (!server_.is_running()) std::this_thread::yield();
  server_.stop();
  endConnections(port_);
  thread_.join();
}

bool HttpServer::isFromHere(const httplib::Request& request) const {
  std::string host = request.get_header_value("Host");
  // Without its port, which a tunnel may change.
  if (const std::size_t colon = host.rfind(':');
      colon != std::string::npos && host.find(']', colon) == std::string::npos)
    host.resize(colon);
  const bool isKnown = host == "127.0.0.1" || host == "localhost" || host == "[::1]" ||
                       host == options_.host || host == "[" + options_.host + "]";
  if (!isKnown && options_.host != "0.0.0.0" && options_.host != "::") return false;
  const std::string origin = request.get_header_value("Origin");
  return request.method == "GET" || origin.empty() || origin == "http://" + request.get_header_value("Host");
}

void HttpServer::route() {
  server_.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
    response.set_header("X-Content-Type-Options", "nosniff");
    response.set_header("Referrer-Policy", "no-referrer");
    response.set_header("Cache-Control", "no-store");
    response.set_header("Content-Security-Policy",
                        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src "
                        "'self' blob: data:; "
                        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    if (isFromHere(request)) return httplib::Server::HandlerResponse::Unhandled;
    response.status = 403;
    sendJson(errorOf(Error("not from this page")), response);
    return httplib::Server::HandlerResponse::Handled;
  });
  server_.set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
    response.status = 500;
    sendJson(errorOf(Error("the request could not be answered")), response);
  });
  const std::string base = "/" + word_ + "/";
  server_.Get(
      base + "([a-z_]*\\.?[a-z]*)", [this](const httplib::Request& request, httplib::Response& response) {
        const std::string name = request.matches[1].length() ? request.matches[1].str() : "index.html";
        if (name == "controls" || name == "stream") {
          try {
            name == "stream" ? stream(request, response) : sendJson(controls(), response);
          } catch (const std::exception& error) {
            response.status = 422;
            sendJson(errorOf(error), response);
          }
          return;
        }
        if (name == "pixel") {
          const auto number = [&](const char* key) {
            return parseNumber(request.get_param_value(key)).value_or(-1);
          };
          return sendJson(engine_.pixel(request.get_param_value("page"), number("x"), number("y")), response);
        }
        sendFile(name, response);
      });
  server_.Get(base + "(look/[a-z-]+\\.jpg)",
              [](const httplib::Request& request, httplib::Response& response) {
                sendFile(request.matches[1].str(), response);
              });
  answer("settings", &HttpServer::setSettings);
  answer("wedge", &HttpServer::makeWedge);
  answer("command", &HttpServer::commandLines);
  answer("recipe", &HttpServer::recipe);
  answer("save-look", &HttpServer::saveLook);
  answer("job", &HttpServer::startJob);
  answer("stop", &HttpServer::stopJob);
}

void HttpServer::answer(const std::string& name, Handler handler) {
  server_.Post("/" + word_ + "/" + name,
               [this, handler](const httplib::Request& request, httplib::Response& response) {
                 nlohmann::json result;
                 try {
                   result = (this->*handler)(bodyOf(request.body));
                 } catch (const nlohmann::json::exception&) {
                   response.status = 400;
                   result = errorOf(LookFault("", "the body has values of other types than it should"));
                 } catch (const std::exception& error) {
                   response.status = 422;
                   result = errorOf(error);
                 }
                 sendJson(result, response);
               });
}

void HttpServer::stream(const httplib::Request& request, httplib::Response& response) {
  const std::string name = request.get_param_value("page");
  const std::shared_ptr<LookPage> page = engine_.open(checkedPage(name));
  if (!page) {
    response.status = 429;
    return sendJson(errorOf(Error(fmt::format("at most {} pages at once", LookEngine::kMostPages))),
                    response);
  }
  constexpr double kHeartbeat = 5;
  response.set_chunked_content_provider(
      "application/octet-stream",
      [page](std::size_t, httplib::DataSink& sink) {
        std::string bytes;
        if (!page->next(bytes, kHeartbeat)) {
          sink.done();
          return true;
        }
        return sink.write(bytes.data(), bytes.size());
      },
      [this, name, page](bool) { engine_.close(name, page); });
}

nlohmann::json HttpServer::controls() const {
  const LookSubject& subject = options_.subject;
  auto views = nlohmann::json::array();
  for (const LookShow::What what : subject.views()) views.push_back(LookShow::word(what));
  return {{"version", options_.version},
          {"input",
           {{"name", subject.path.empty() ? "a cloud of its own" : subject.path}, {"kind", subject.word()}}},
          {"has_cloud", subject.hasCloud()},
          {"views", views},
          {"show", LookShow::word(options_.what)},
          {"settings", options_.settings},
          {"groups", lookControls(subject)},
          {"parameters", lookParameters(subject)},
          {"looks", shippedLooks(subject)},
          {"saved", savedLooks(subject)}};
}

nlohmann::json HttpServer::setSettings(const nlohmann::json& body) {
  LookRequest request = requestOf(options_.subject, body);
  const std::int64_t revision = request.revision;
  {
    const std::lock_guard lock(mutex_);
    if (latest_.size() > 4 * LookEngine::kMostPages) latest_.clear();
    latest_[request.page] = request;
  }
  engine_.ask(std::move(request));
  return {{"revision", revision}};
}

nlohmann::json HttpServer::makeWedge(const nlohmann::json& body) {
  LookWedge wedge = wedgeOf(options_.subject, body);
  const std::size_t count = wedge.cells.size();
  engine_.ask(std::move(wedge));
  return {{"count", count}};
}

LookExports HttpServer::exportsOf(const nlohmann::json& body) const {
  const auto plan = planOf(options_.subject, body);
  LookExports exports{options_.subject, plan->settings, plan->what};
  readSize(body, exports.width, exports.height);
  return exports;
}

nlohmann::json HttpServer::commandLines(const nlohmann::json& body) {
  return {{"lines", exportsOf(body).typed()}};
}

nlohmann::json HttpServer::recipe(const nlohmann::json& body) {
  const LookExports exports = exportsOf(body);
  if (options_.subject.kind == LookSubject::Kind::script)
    return {{"name", std::filesystem::path(options_.subject.path).filename().string()},
            {"text", exports.script()}};
  return {{"name", "cloud.toml"}, {"text", exports.recipe()}};
}

nlohmann::json HttpServer::saveLook(const nlohmann::json& body) {
  apps::saveLook(body.value("name", ""), planOf(options_.subject, body)->settings);
  return {{"saved", savedLooks(options_.subject)}};
}

nlohmann::json HttpServer::startJob(const nlohmann::json& body) {
  const LookExports exports = exportsOf(body);
  const std::string what = body.value("what", ""), file = body.value("file", "");
  const std::map<std::string, std::vector<std::string>> endings{
      {"exr", {".exr"}},       {"png", {".png"}}, {"vdb", {".vdb"}},
      {"turntable", {".mp4"}}, {"pieces", {""}},  {"mesh", {".obj", ".ply"}}};
  const auto kind = endings.find(what);
  const bool isOfPieces = exports.what == LookShow::What::pieces,
             isOfTransfer = exports.what == LookShow::What::transfer, isOfShapes = isOfPieces || isOfTransfer;
  std::vector<std::string> allowed{"exr", "png", "turntable"};
  if (isOfShapes) allowed = {isOfPieces ? "pieces" : "mesh", "png"};
  if (options_.subject.hasCloud() && !isOfShapes) allowed.push_back("vdb");
  if (std::ranges::count(allowed, what) == 0)
    throw LookFault("", fmt::format("what: got '{}', allowed: {}", what, fmt::join(allowed, ", ")));
  const auto within = [&](const std::string& name) {
    return (std::filesystem::path(options_.folder) / name).string();
  };
  const std::string path = within(plainFileName(file, kind->second));
  for (const std::string& source : watched()) {
    std::error_code isMissing;
    if (std::filesystem::equivalent(path, source, isMissing))
      throw LookFault("", fmt::format("file: '{}' is what is looked at; give another name", file));
  }
  const auto append = [](std::vector<std::string>& line, const std::vector<std::string>& more) {
    line.insert(line.end(), more.begin(), more.end());
  };
  std::vector<std::vector<std::string>> lines;
  std::vector<std::string> temporary;
  if (what == "vdb") {
    lines.push_back(exports.volumeLine(path));
  } else if (isOfShapes) {
    lines.push_back(exports.shapesLine());
    append(lines.back(), what == "png" ? exports.previewLine(path) : std::vector<std::string>{"-o", path});
  } else {
    const std::string volume = within("." + randomWord() + ".vdb");
    if (options_.subject.hasCloud()) {
      lines.push_back(exports.volumeLine(volume));
      temporary.push_back(volume);
    }
    const bool isTurn = what == "turntable";
    lines.push_back(exports.pictureLine(isTurn ? "turntable" : "render", volume));
    append(lines.back(), {what == "png" ? "--preview" : isTurn ? "--movie" : "-o", path});
    if (what == "exr") {
      // As with the command line that is shown: the sky is a layer where there is a preview.
      temporary.push_back(within("." + randomWord() + ".png"));
      append(lines.back(), {"--preview", temporary.back()});
    }
    if (isTurn) append(lines.back(), {"--frames", body.value("frames", "1-48")});
  }
  return {{"id", jobs_.start(what, std::move(lines), std::move(temporary))}};
}

nlohmann::json HttpServer::stopJob(const nlohmann::json& body) {
  return {{"stopped", jobs_.stop(body.value("id", 0))}};
}

std::vector<std::string> HttpServer::watched() const {
  std::vector<std::string> files;
  for (const std::string* path : {&options_.subject.path, &options_.subject.reference})
    if (!path->empty()) files.push_back(*path);
  const auto add = [&](const LookSettings& settings) {
    for (const char* name : {"recipe", "texture"})
      for (const char* verb : {"cloud", "transfer", "render"})
        if (settings[verb].contains(name)) files.push_back(settings[verb][name].get<std::string>());
  };
  add(options_.settings);
  const std::lock_guard lock(mutex_);
  for (const auto& [page, request] : latest_) add(request.plan->settings);
  return files;
}

void HttpServer::changed(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    const bool isGone = fileStamp(path).empty();
    nlohmann::json message = {
        {"type", "file"}, {"path", path}, {"state", isGone ? "gone" : "changed"}, {"message", ""}};
    if (isGone) message["message"] = path + ": there is no such file now";
    try {
      if (!isGone && path == options_.subject.path) lookParameters(options_.subject);
    } catch (const std::exception& error) {
      message["state"] = "bad";
      message["message"] = error.what();
    }
    engine_.tell(message);
    if (message["state"] != "changed") return;
  }
  std::vector<LookRequest> again;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [page, request] : latest_) again.push_back(request);
  }
  for (LookRequest& request : again) try {
      request.hurries = false;
      request.plan =
          std::make_shared<const LookPlan>(options_.subject, request.plan->settings, request.show.what);
      engine_.ask(std::move(request));
    } catch (const std::exception& error) {
      engine_.tell({{"type", "file"}, {"path", paths.front()}, {"state", "bad"}, {"message", error.what()}});
    }
}

}  // namespace

std::unique_ptr<LookServer> makeLookServer(const LookServerOptions& options) {
  return std::make_unique<HttpServer>(options);
}

}  // namespace nephele::apps
