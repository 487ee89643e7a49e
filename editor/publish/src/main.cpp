// The service in a worker of a published page. worker.js calls these functions, which come back in Module.
#include "bf/service/service.hpp"
#include "bf/service/worker.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <emscripten.h>
#include <memory>
#include <string>

// clang-format off
EM_JS(void, page_say, (const char* text, int size), { Module.say(UTF8ToString(text, size)); });
EM_JS(void, page_send, (const char* bytes, int size), { Module.send(HEAPU8.slice(bytes, bytes + size).buffer); });
// clang-format on

namespace {

using bf::service::Service;
using bf::service::Worker;

void say_text(const std::string& text) { page_say(text.data(), static_cast<int>(text.size())); }
void send_bytes(const std::string& bytes) { page_send(bytes.data(), static_cast<int>(bytes.size())); }

struct Published {
    Published(const char* file, const char* recording)
        : service({.file = file,
                   .version = BF_VERSION,
                   .post = [this](std::function<void()> task) { later.post(std::move(task)); },
                   .tell = say_text,
                   .send = send_bytes,
                   .recording = recording}) {}

    Worker later;
    Service service;
};

std::unique_ptr<Published> published;

} // namespace

extern "C" {

/// Opens the model of a file that is there, for a run or, where there is a recording, for that in place of a
/// run. Gives why not; empty: it is open.
EMSCRIPTEN_KEEPALIVE const char* bf_open(const char* file, const char* recording) {
    static std::string wrong;
    ::setenv("BLOCKFACTORY_PLUGIN_PATH", "/plugins", 1); // where worker.js puts declarations
    try {
        published = std::make_unique<Published>(file, recording);
        wrong.clear();
    } catch (const std::exception& error) {
        wrong = error.what();
    }
    return wrong.c_str();
}

/// Says the answer.
EMSCRIPTEN_KEEPALIVE void bf_answer(const char* request) { say_text(published->service.answer(0, request)); }

/// Sends what there is under this name; false: nothing.
EMSCRIPTEN_KEEPALIVE bool bf_data(const char* what) {
    const auto data = published->service.data(what);
    if (data) send_bytes(*data);
    return data.has_value();
}

/// Does what is due. Gives the time until the next call [ms]; below 0: none is needed.
EMSCRIPTEN_KEEPALIVE double bf_work() {
    const Worker::Time next = Worker::turn_all();
    if (next == Worker::never) return -1;
    const std::chrono::duration<double, std::milli> wait = next - std::chrono::steady_clock::now();
    return std::max(0.0, wait.count());
}
}
