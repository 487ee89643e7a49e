#include "bf/service/server.hpp"

#include "folder.hpp"
#include "scenery.hpp"
#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <thread>

namespace {

namespace fs = std::filesystem;
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = asio::ip::tcp;
using Socket = beast::websocket::stream<tcp::socket>;

class ServerTest : public ::testing::Test {
  protected:
    void SetUp() override {
        folder_ = bf::service::test_folder();
        fs::create_directory(folder_ / "page");
        fs::copy_file(fs::path(BF_SOURCE_DIRECTORY) / "docs" / "start" / "motor.yaml",
                      folder_ / "motor.yaml");
        std::ofstream(folder_ / "page" / "index.html") << "<!doctype html>";
        std::ofstream(folder_ / "secret.txt") << "secret";
        fs::create_symlink(folder_ / "secret.txt", folder_ / "page" / "link.txt");
        server = std::make_unique<bf::service::Server>(
            bf::service::ServerOptions{.file = folder_ / "motor.yaml",
                                       .page = folder_ / "page",
                                       .version = "1",
                                       .sceneries = [](const bf::Diagram& diagram) {
                                           return bf::service::one_body(diagram, "load.y");
                                       }});
        thread_ = std::thread([this] { server->run([this] { return !ends_; }); });
    }
    void TearDown() override {
        ends_ = true;
        thread_.join();
    }

    tcp::socket connected() {
        tcp::socket socket(io);
        socket.connect({asio::ip::address_v4::loopback(), server->port()});
        return socket;
    }
    std::string host() const { return "127.0.0.1:" + std::to_string(server->port()); }

    http::response<http::string_body> get(const std::string& target, const std::string& of_host = {}) {
        tcp::socket socket = connected();
        http::request<http::empty_body> request(http::verb::get, target, 11);
        request.set(http::field::host, of_host.empty() ? host() : of_host);
        http::write(socket, request);
        beast::flat_buffer buffer;
        http::response<http::string_body> response;
        http::read(socket, buffer, response);
        return response;
    }
    /// The status that a WebSocket gets that comes from `origin` with this token.
    http::status shaken(const std::string& token, const std::string& origin) {
        Socket socket(connected());
        if (!origin.empty())
            socket.set_option(beast::websocket::stream_base::decorator(
                [&](beast::websocket::request_type& request) { request.set(http::field::origin, origin); }));
        beast::websocket::response_type response;
        beast::error_code error;
        socket.handshake(response, host(), "/socket?token=" + token, error);
        return response.result();
    }
    Socket page() {
        Socket socket(connected());
        socket.handshake(host(), "/socket?token=" + server->token());
        return socket;
    }
    static std::string read(Socket& socket) {
        beast::flat_buffer buffer;
        socket.read(buffer);
        return beast::buffers_to_string(buffer.data());
    }
    /// What comes in answer to request 7; notifications come between.
    static std::string ask(Socket& socket, const std::string& request) {
        socket.write(asio::buffer(request));
        for (;;)
            if (std::string text = read(socket); text.find("\"id\":7") != std::string::npos) return text;
    }

    asio::io_context io;
    std::unique_ptr<bf::service::Server> server;

  private:
    fs::path folder_;
    std::atomic<bool> ends_{false};
    std::thread thread_;
};

const std::string hello = R"({"jsonrpc": "2.0", "id": 7, "method": "hello", "params": {"protocol": )" +
                          std::to_string(bf::service::protocol_version) + "}}";

TEST_F(ServerTest, ServesThePageUnderAStrictPolicy) {
    const auto response = get("/?token=" + server->token());
    EXPECT_EQ(response.result(), http::status::ok);
    EXPECT_EQ(response.body(), "<!doctype html>");
    const std::string policy(response["Content-Security-Policy"]);
    EXPECT_EQ(policy.find("default-src 'none'"), 0u);
    EXPECT_EQ(policy.find("unsafe-inline"), std::string::npos);
    EXPECT_EQ(policy.find("'unsafe-eval'"), std::string::npos);
}

TEST_F(ServerTest, GivesNothingOutsideOfThePage) {
    for (const char* target : {"/../secret.txt", "/..%2fsecret.txt", "/link.txt", "//etc/passwd",
                               "/assets/../../secret.txt", "/.", "/nothing.js", "/motor.yaml"})
        EXPECT_EQ(get(target).result(), http::status::not_found) << target;
}

TEST_F(ServerTest, GivesMeshesOfTheSceneToWhoKnowsTheToken) {
    Socket one = page();
    const std::string token = "?token=" + server->token(), look = R"({"id": 7, "method": "scene"})";
    while (ask(one, look).find("\"worlds\":[]") != std::string::npos) continue; // until the model is checked
    EXPECT_EQ(get("/meshes/1/0" + token).body(), "meshes of load.y");
    EXPECT_EQ(get("/meshes/1/0").result(), http::status::forbidden);
    EXPECT_EQ(get("/meshes/1/0?token=" + server->token().substr(1)).result(), http::status::forbidden);
    for (const char* other :
         {"/meshes/1/1", "/meshes/2/0", "/meshes/../secret.txt", "/meshes/", "/meshes//etc/passwd"})
        EXPECT_EQ(get(other + token).result(), http::status::not_found) << other;
}

TEST_F(ServerTest, AnswersItsOwnAddressAlone) {
    EXPECT_EQ(get("/", "evil.example").result(), http::status::forbidden);
    EXPECT_EQ(get("/", "127.0.0.1:1").result(), http::status::forbidden);
    EXPECT_EQ(get("/", "localhost:" + std::to_string(server->port())).result(), http::status::ok);
}

TEST_F(ServerTest, LetsNobodyInWithoutTheTokenOrFromAnotherPage) {
    const std::string token = server->token(), own = "http://" + host();
    EXPECT_EQ(shaken(token, own), http::status::switching_protocols);
    EXPECT_EQ(shaken(token, ""), http::status::switching_protocols);
    EXPECT_EQ(shaken(token, "http://evil.example"), http::status::forbidden);
    EXPECT_EQ(shaken(token, "null"), http::status::forbidden);
    EXPECT_EQ(shaken("", own), http::status::forbidden);
    EXPECT_EQ(shaken(token.substr(1), own), http::status::forbidden);
    EXPECT_EQ(shaken(token + "0", own), http::status::forbidden);
}

TEST_F(ServerTest, TwoPagesSeeEachOthersChanges) {
    Socket one = page(), two = page();
    EXPECT_NE(ask(one, hello).find("\"result\""), std::string::npos);
    EXPECT_NE(ask(two, hello).find("\"result\""), std::string::npos);
    ask(one,
        R"({"id": 7, "method": "edit", "params": {"operation": {"do": "rename", "path": "load", "name": "brake"}}})");
    std::string told;
    do told = read(two);
    while (told.find("\"revision\":1") == std::string::npos);
    EXPECT_NE(told.find("\"method\":\"changed\""), std::string::npos);
}

TEST_F(ServerTest, GarbageHarmsNobody) {
    Socket good = page();
    std::mt19937 random(1);
    for (int i = 0; i < 200; ++i) {
        std::string frame = hello;
        for (int k = 0; k < 5; ++k) frame[random() % frame.size()] = static_cast<char>(random());
        Socket bad = page();
        bad.binary(i % 2 == 0);
        beast::error_code error;
        bad.write(asio::buffer(frame), error);
        if (i % 3 == 0) bad.next_layer().close(error); // without saying goodbye
        if (i % 3 == 1)
            asio::write(bad.next_layer(), asio::buffer(std::string("\xff\xff\xff\xff", 4)), error);
    }
    EXPECT_NE(ask(good, hello).find("\"version\":\"1\""), std::string::npos);
}

TEST_F(ServerTest, WhoSendsTooMuchIsToldTheLimit) {
    Socket greedy = page(), good = page();
    const std::size_t limit = std::size_t{16} << 20;
    EXPECT_NE(ask(greedy, std::string(limit - 1000, ' ') + hello).find("\"version\":\"1\""),
              std::string::npos);
    beast::error_code error;
    greedy.write(asio::buffer(std::string(limit + 1, ' ')), error);
    beast::flat_buffer buffer;
    while (!error) greedy.read(buffer, error);
    EXPECT_EQ(error, beast::websocket::error::closed);
    EXPECT_EQ(greedy.reason().code, beast::websocket::close_code::too_big);
    EXPECT_EQ(greedy.reason().reason, "a message has at most 16777216 bytes");
    EXPECT_NE(ask(good, hello).find("\"version\":\"1\""), std::string::npos);
}

TEST_F(ServerTest, APageThatReadsNothingDelaysNoOther) {
    Socket stalled = page(), good = page();
    for (int i = 0; i < 2000; ++i)
        stalled.write(asio::buffer(std::string(R"({"id": 8, "method": "library"})")));
    EXPECT_NE(ask(good, hello).find("\"result\""), std::string::npos);
}

} // namespace
