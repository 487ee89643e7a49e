// Serves the page and its service to browsers on this computer.
#pragma once

#include "bf/service/scenery.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace bf::service {

struct ServerOptions {
    std::filesystem::path file;                    ///< the model to open; see Service::Options
    std::filesystem::path page;                    ///< folder with the page's files
    std::string version;                           ///< of the program
    std::string token = {};                        ///< which pages must know; made if it is empty
    std::uint16_t port = 0;                        ///< 0: any free one
    std::size_t most_pages = 16;                   ///< connections
    MakeSceneries sceneries = {};                  ///< see Service::Options
    std::string attach = {};                       ///< see Service::Options
    std::filesystem::path recording = {};          ///< see Service::Options
    std::size_t page_bytes = std::size_t{8} << 20; ///< waiting for one page; samples beyond are lost
};

/// HTTP and one WebSocket at 127.0.0.1 alone. Every user of this computer and every page in a browser can
/// reach that, so whoever connects must know the token, come from the address itself (Host and Origin), and
/// gets no file that is not in the folder of the page.
class Server {
  public:
    /// Listens at once. Throws model::Errors, FileError for the model, std::runtime_error when the port
    /// cannot be had.
    explicit Server(const ServerOptions& options);
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    /// For a browser: http://127.0.0.1:PORT/?token=TOKEN
    std::string address() const;
    std::uint16_t port() const;
    const std::string& token() const;

    /// Serves until `go_on`, asked several times a second, says no. Returns which files are without the last
    /// edits, and why; empty: none.
    std::string run(const std::function<bool()>& go_on);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace bf::service
