// What pages see of charts, masks, images, parameters and earlier versions.
#include "bf/service/service.hpp"

#include "bf/base/files.hpp"
#include "folder.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <gtest/gtest.h>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

namespace {

namespace fs = std::filesystem;
using bf::service::Service;
using Json = nlohmann::json;

class LookTest : public ::testing::Test {
  protected:
    void SetUp() override { folder_ = bf::service::test_folder(); }
    void TearDown() override { service_.reset(); }

    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name) << text;
    }
    std::string read(const std::string& name) const { return bf::read_text_file(folder_ / name); }
    const fs::path& folder() const { return folder_; }
    void open(const std::string& name = "m.yaml") {
        service_ = std::make_unique<Service>(Service::Options{
            folder_ / name, "1", post(), [](const std::string&) {}, [](const std::string&) {}, {}, {}});
    }
    Json ask(const std::string& method, const Json& params = Json::object()) {
        return Json::parse(service_->answer(
            1, Json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump()));
    }
    Json result(const std::string& method, const Json& params = Json::object()) {
        const Json answer = ask(method, params);
        EXPECT_TRUE(answer.contains("result")) << answer.dump();
        return answer.value("result", Json());
    }
    std::string refusal(const std::string& method, const Json& params = Json::object()) {
        return ask(method, params).value("/error/message"_json_pointer, std::string());
    }
    Json element(const Json& drawing, const std::string& path) {
        for (const auto& e : drawing["elements"])
            if (e["path"] == path) return e;
        ADD_FAILURE() << "nothing is drawn of " << path;
        return {};
    }
    Json edit(const Json& operation) { return result("edit", {{"operation", operation}}); }
    Json field(const Json& inspection, const std::string& name) {
        for (const auto& f : inspection["fields"])
            if (f["name"] == name) return f;
        return {};
    }
    std::optional<std::string> data(const std::string& what) { return service_->data(what); }
    /// Until the model is checked.
    void wait() {
        for (int i = 0; i < 2000; ++i) {
            std::vector<std::function<void()>> tasks;
            {
                const std::lock_guard lock(mutex_);
                tasks.swap(tasks_);
            }
            for (const auto& task : tasks) task();
            if (result("hello", {{"protocol", bf::service::protocol_version}})["document"]["is_checked"] ==
                true)
                return;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        ADD_FAILURE() << "the model is not checked";
    }

  private:
    std::function<void(std::function<void()>)> post() {
        return [this](std::function<void()> task) {
            const std::lock_guard lock(mutex_);
            tasks_.push_back(std::move(task));
        };
    }
    fs::path folder_;
    std::mutex mutex_;
    std::vector<std::function<void()>> tasks_;
    std::unique_ptr<Service> service_;
};

TEST_F(LookTest, AMovedStateKeepsTheOthersWhereTheyAreSeen) {
    write("m.yaml",
          "model: m\nstep: 0.1\nblocks:\n  machine:\n    block: StateMachine\n    states: [idle, move]\n"
          "    transitions: [1 2 0 1; 2 1 0 1]\n");
    open();
    wait();
    const Json before = result("draw", {{"system", "machine"}});
    edit({{"do", "move"}, {"path", "machine.move"}, {"to", {{"x", 500}, {"y", 300}}}});
    const Json after = result("draw", {{"system", "machine"}});
    EXPECT_EQ(element(after, "machine.move")["bounds"]["x"], 500);
    EXPECT_EQ(element(after, "machine.idle")["bounds"], element(before, "machine.idle")["bounds"]);
    EXPECT_NE(read("m.yaml").find("machine.move: {x: 500, y: 300}"), std::string::npos);
    edit({{"do", "bend"}, {"path", "machine.idle.2"}, {"points", {{{"x", 400}, {"y", 400}}}}});
    EXPECT_EQ(field(result("inspect", {{"path", "machine.move.1"}}), "minimum_time")["text"], "1");
}

TEST_F(LookTest, ASubsystemShowsItsVariablesAsParametersWithUnitsAndLimits) {
    write("part.yaml",
          "model: part\ndoc: A spring.\nvariables:\n  k: {value: 2, minimum: 0, unit: N/m, doc: stiffness}\n"
          "  S: {a: 1}\nblocks:\n  gain: {block: Gain, K: k}\n");
    write("m.yaml",
          "model: m\nstep: 0.1\nvariables: {T: 3}\nblocks:\n  spring: {file: part.yaml, with: {k: T}}\n"
          "  own:\n    icon: K\n    variables: {a: 1, b: 2*a}\n    blocks:\n      one: {block: Constant, "
          "value: b}\n");
    open();
    wait();
    Json k = field(result("inspect", {{"path", "spring"}}), "k");
    EXPECT_EQ(k["role"], "parameter");
    EXPECT_EQ(k["text"], "T");
    EXPECT_EQ(k["initial"], "2");
    EXPECT_EQ(k["value"], "3");
    EXPECT_EQ(k["unit"], "N/m");
    EXPECT_EQ(k["least"], 0);
    EXPECT_NE(k["doc"].get<std::string>().find("stiffness"), std::string::npos);
    EXPECT_TRUE(field(result("inspect", {{"path", "spring"}}), "S.a").is_null());
    edit({{"do", "set"}, {"path", "spring"}, {"name", "k"}, {"value", "2*T"}});
    EXPECT_NE(read("m.yaml").find("with: {k: 2*T}"), std::string::npos);
    edit({{"do", "set"}, {"path", "spring"}, {"name", "k"}});
    EXPECT_EQ(read("m.yaml").find("with"), std::string::npos) << read("m.yaml");
    edit({{"do", "set"}, {"path", "own"}, {"name", "b"}, {"value", "3*a"}});
    EXPECT_NE(read("m.yaml").find("variables: {a: 1, b: 3*a}"), std::string::npos);
    EXPECT_EQ(result("evaluate", {{"path", "own"}, {"name", "b"}, {"text", "5*a"}})["value"], "5");
    const std::string wrong =
        refusal("edit", {{"operation", {{"do", "set"}, {"path", "spring"}, {"name", "kk"}, {"value", "1"}}}});
    EXPECT_NE(wrong.find("m.yaml:5:3: spring: there is no 'kk' to set here; known are 'k', 'S'"), wrong.npos)
        << wrong;
}

TEST_F(LookTest, ListsAllParametersByBlock) {
    write("m.yaml",
          "model: m\nstep: 0.1\nvariables: {K: 3}\nblocks:\n  inner:\n    variables: {a: 1}\n    blocks:\n"
          "      gain: {block: Gain, K: 2*K}\n      end: {block: Terminator}\n");
    open();
    wait();
    const Json blocks = result("parameters")["blocks"];
    ASSERT_EQ(blocks.size(), 3u) << blocks.dump();
    EXPECT_EQ(blocks[0]["path"], "");
    EXPECT_EQ(blocks[1]["path"], "inner");
    EXPECT_EQ(blocks[2]["path"], "inner.gain");
    EXPECT_EQ(blocks[2]["fields"][0]["text"], "2*K");
    EXPECT_EQ(blocks[2]["fields"][0]["value"], "6");
    edit({{"do", "set"}, {"path", ""}, {"name", "K"}, {"value", "4"}});
    EXPECT_NE(read("m.yaml").find("variables: {K: 4}"), std::string::npos);
}

constexpr const char* png_begin = "\x89PNG\r\n\x1a\n";

TEST_F(LookTest, ShowsImagesOfTheFolderAndNoOtherFile) {
    write("arm.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='10' height='10'/>");
    write("arm.png", png_begin);
    write("fake.png", "no image");
    write("secret.txt", "secret");
    std::ofstream(folder().parent_path() / "outside.svg") << "<svg/>";
    fs::create_symlink(folder().parent_path() / "outside.svg", folder() / "link.svg");
    write("m.yaml", "model: m\nblocks: {a: {block: Constant}}\nlayout:\n  notes:\n"
                    "    right: {text: the arm, image: arm.svg, x: 1, y: 2, width: 30, height: 40}\n"
                    "    fake: {image: fake.png, x: 1, y: 2}\n    text: {image: secret.txt, x: 1, y: 2}\n"
                    "    out: {image: ../outside.svg, x: 1, y: 2}\n    link: {image: link.svg, x: 1, y: 2}\n"
                    "    gone: {image: gone.svg, x: 1, y: 2}\n");
    open();
    const Json drawing = result("draw", {{"system", ""}});
    const Json right = element(drawing, "right");
    EXPECT_EQ(right["shapes"][0]["kind"], "image");
    EXPECT_EQ(right["bounds"]["height"], 40);
    EXPECT_EQ(right["image"], "arm.svg");
    const std::string address = right["shapes"][0]["text"];
    EXPECT_EQ(address, "images/0.svg");
    EXPECT_EQ(data(address).value_or("").substr(0, 4), "<svg");
    const std::map<std::string, std::string> defects = {
        {"fake", "the image 'fake.png' holds no PNG"},
        {"text", "the image 'secret.txt' is neither a PNG nor an SVG file"},
        {"out", "the image 'outside.svg' lies outside of the folder of the model"},
        {"link", "the image 'link.svg' lies outside of the folder of the model"},
        {"gone", "the image 'gone.svg' is not there"}};
    for (const auto& [name, defect] : defects) {
        const Json wrong = element(drawing, name);
        EXPECT_EQ(wrong["marks"][0]["message"], defect);
        EXPECT_EQ(wrong["shapes"][0]["kind"], "polygon");
    }
    for (const char* what :
         {"images/1.svg", "images/0.png", "images/../secret.txt", "images/", "images/arm.svg"})
        EXPECT_FALSE(data(what)) << what;
    EXPECT_EQ(result("images", {{"system", ""}})["files"],
              Json::array({"arm.png", "fake.png", "arm.svg", "link.svg"}));
    fs::resize_file(folder() / "arm.svg", (4 << 20) + 1);
    EXPECT_EQ(element(result("draw", {{"system", ""}}), "right")["marks"][0]["message"],
              "the image 'arm.svg' is larger than 4 MiB");
    EXPECT_FALSE(data(address)) << "it has become too large since it was drawn";
}

TEST_F(LookTest, ComparesWithAnotherFileOfTheFolder) {
    write("old.yaml", "model: m\nblocks:\n  a: {block: Constant, value: 1}\n  gone: {block: Constant}\n");
    write("m.yaml", "model: m\nblocks:\n  a: {block: Constant, value: 2}\n  new: {block: Gain}\n");
    open();
    const Json found = result("compare", {{"file", "old.yaml"}, {"system", ""}});
    std::vector<std::string> texts;
    for (const auto& d : found["differences"]) texts.push_back(d["text"]);
    EXPECT_EQ(texts,
              (std::vector<std::string>{"- gone: Constant", "~ a: setting value: 1 -> 2", "+ new: Gain"}));
    const auto count = [&](const char* path) {
        return std::ranges::count_if(found["drawing"]["elements"],
                                     [&](const Json& e) { return e["path"] == path; });
    };
    EXPECT_EQ(count("a"), 2);
    EXPECT_EQ(count("gone"), 1);
    EXPECT_NE(refusal("compare", {{"file", "../m.yaml"}, {"system", ""}}), "");
    EXPECT_NE(refusal("compare", {{"file", ""}, {"system", ""}}), "") << "there is no commit";
}

TEST_F(LookTest, ComparesWithTheLastCommitWithTheFilesThatItHad) {
    const auto git = [&](const std::string& what) {
        return std::system(("cd '" + folder().string() +
                            "' && git -c user.name=a -c user.email=a@b -c commit.gpgsign=false " + what +
                            " > /dev/null 2>&1")
                               .c_str()) == 0;
    };
    if (!git("init")) GTEST_SKIP() << "git is missing";
    write("part.yaml", "model: part\nblocks:\n  gain: {block: Gain, K: 1}\n");
    write("m.yaml", "model: m\nblocks:\n  p: {file: part.yaml}\n");
    ASSERT_TRUE(git("add -A") && git("commit -m one"));
    open();
    EXPECT_TRUE(result("compare", {{"file", ""}, {"system", ""}})["differences"].empty());
    edit({{"do", "set"}, {"path", "p.gain"}, {"name", "K"}, {"value", "2"}});
    const Json found = result("compare", {{"file", ""}, {"system", "p"}})["differences"];
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0]["text"], "~ p.gain: setting K: 1 -> 2");
    EXPECT_EQ(found[0]["system"], "p");
}

TEST_F(LookTest, SaysWhichWatchedPathsAreNoSignals) {
    write("m.yaml", "model: m\nstep: 0.1\nstop: 1\nblocks:\n  a: {block: Constant}\n");
    open();
    wait();
    EXPECT_TRUE(result("watch", {{"paths", {"b.y"}}})["unknown"].empty()) << "nothing runs";
    result("run", {{"action", "step"}});
    EXPECT_EQ(result("watch", {{"paths", {"a.y", "b.y"}}})["unknown"], Json::array({"b.y"}));
}

} // namespace
