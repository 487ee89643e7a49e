#pragma once

#include "bf/service/service.hpp"
#include "folder.hpp"

#include <condition_variable>
#include <cstring>
#include <deque>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace bf::service {

/// Asks a service as a page does, without a network: tasks of the service run when the test waits for them.
class AskingTest : public ::testing::Test {
  protected:
    using Json = nlohmann::json;

    AskingTest() : folder(test_folder()) {}
    void TearDown() override { service.reset(); }

    void open(const std::string& name, MakeSceneries sceneries = {},
              const std::filesystem::path& recording = {}, const std::string& attach = {}) {
        service = std::make_unique<Service>(
            Service::Options{name.empty() ? std::filesystem::path() : folder / name, "1.2.3",
                             [this](std::function<void()> task) {
                                 const std::lock_guard lock(mutex_);
                                 tasks_.push_back(std::move(task));
                                 wake_.notify_one();
                             },
                             [this](const std::string& text) { told.push_back(Json::parse(text)); },
                             [this](const std::string& frame) {
                                 sent_bytes += frame.size();
                                 if (!frame.empty()) last_frame = frame;
                             },
                             std::move(sceneries), attach, recording});
    }

    Json ask(const std::string& method, const Json& params = Json::object()) {
        return Json::parse(service->answer(
            page, Json{{"jsonrpc", "2.0"}, {"id", 7}, {"method", method}, {"params", params}}.dump()));
    }
    Json result(const std::string& method, const Json& params = Json::object()) {
        const Json answer = ask(method, params);
        EXPECT_TRUE(answer.contains("result")) << method << ": " << answer.dump();
        EXPECT_EQ(answer["id"], 7);
        return answer.value("result", Json());
    }
    std::string refusal(const std::string& method, const Json& params = Json::object()) {
        const Json answer = ask(method, params);
        return answer.contains("error") ? answer["error"]["message"].get<std::string>() : "";
    }
    /// Runs tasks until a notification says what is asked for.
    Json wait_for(const std::function<bool(const Json&)>& is_it) {
        for (std::size_t seen = 0;;) {
            for (; seen < told.size(); ++seen)
                if (is_it(told[seen])) return told[seen];
            std::unique_lock lock(mutex_);
            if (!wake_.wait_for(lock, std::chrono::seconds(20), [&] { return !tasks_.empty(); })) return {};
            const auto task = std::move(tasks_.front());
            tasks_.pop_front();
            lock.unlock();
            task();
        }
    }
    /// Waits until the files are as the model.
    void settle() {
        while (!result("hello", {{"protocol", protocol_version}})["document"]["is_saved"].get<bool>())
            wait_for([&, first = told.size()](const Json&) { return told.size() > first; });
    }
    /// The state of the document with the next check.
    Json checked() {
        told.clear();
        return wait_for([](const Json& n) {
            return n["method"] == "changed" && n["params"]["is_checked"] == true;
        })["params"];
    }

    const std::filesystem::path folder;
    std::unique_ptr<Service> service;
    int page = 1; ///< that asks
    std::vector<Json> told;
    std::size_t sent_bytes = 0;
    std::string last_frame;
    /// Of the last `count` doubles that were sent, the one of that number.
    double last_value(std::size_t count, std::size_t number) const {
        double value = 0;
        std::memcpy(&value, last_frame.data() + last_frame.size() - 8 * (count - number), sizeof value);
        return value;
    }

  private:
    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<std::function<void()>> tasks_;
};

} // namespace bf::service
