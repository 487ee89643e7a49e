#include "bf/formats/yaml.hpp"
#include "growth.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

namespace bf::formats {
namespace {

const std::filesystem::path seed_folder = BF_SOURCE_DIRECTORY "/tests/models/yaml";

std::vector<std::string> samples() {
    std::vector<std::string> texts;
    for (const char* name : {"two_masses.yaml", "pd.yaml", "nested.yaml"}) {
        std::ostringstream text;
        text << std::ifstream(seed_folder / name, std::ios::binary).rdbuf();
        texts.push_back(text.str());
    }
    return texts;
}

/// Reads `text`: either it is refused with places in the file, or what is written is read back and written
/// again the same. Returns whether it was read.
bool survives(const std::string& text) {
    const std::string name = (seed_folder / "text.yaml").string();
    std::string once;
    try {
        const model::Model read = read_yaml_text(text, name);
        once = canonical_yaml(read);
        EXPECT_EQ(write_yaml(read), text);
    } catch (const model::Errors& errors) {
        EXPECT_FALSE(errors.diagnostics().empty()) << text;
        for (const model::Diagnostic& d : errors.diagnostics()) {
            EXPECT_TRUE(d.where) << text << "\n" << d.text();
            EXPECT_GT(d.where.column, 0) << text << "\n" << d.text();
            EXPECT_LE(d.where.line, 1 + std::ranges::count(text, '\n') + std::ranges::count(text, '\r'))
                << d.text();
        }
        return false;
    }
    try {
        EXPECT_EQ(canonical_yaml(read_yaml_text(once, name)), once) << "from:\n" << text;
    } catch (const model::Errors& errors) {
        ADD_FAILURE() << errors.what() << "\nin what was written:\n" << once << "\nfrom:\n" << text;
    }
    return true;
}

TEST(Fuzz, TruncationAtEveryByteIsReadOrLocated) {
    for (const std::string& sample : samples())
        for (std::size_t length = 0; length <= sample.size() && !testing::Test::HasFailure(); ++length)
            survives(sample.substr(0, length));
}

/// Whether a line end stands in one of the samples' literal texts.
bool in_literal(const std::string& sample, std::size_t end) {
    const std::size_t doc = sample.find("doc: |"), code = sample.find("code: |");
    return (doc < end && end < sample.find("plugins:")) ||
           (code < end && end < sample.find("# comment after the"));
}

TEST(Fuzz, ACommentAtAnyPositionIsKeptOnce) {
    const std::string name = (seed_folder / "text.yaml").string(), mark = "# a further comment";
    int kept = 0;
    for (const std::string& sample : samples())
        for (std::size_t end = 0; (end = sample.find('\n', end)) != std::string::npos; ++end)
            for (const std::string& insertion :
                 {" " + mark, "\n" + mark, "\n          " + mark, "\n\n\n" + mark + "\n"}) {
                std::string text = sample, once;
                text.insert(end, insertion);
                try {
                    once = canonical_yaml(read_yaml_text(text, name));
                } catch (const model::Errors& errors) {
                    EXPECT_TRUE(in_literal(sample, end)) << errors.what(); // a comment would end the text
                    continue;
                }
                const std::size_t first = once.find(mark);
                ASSERT_NE(first, std::string::npos) << text;
                EXPECT_EQ(once.find(mark, first + 1), std::string::npos) << text;
                EXPECT_EQ(canonical_yaml(read_yaml_text(once, name)), once) << text;
                ++kept;
            }
    EXPECT_GT(kept, 500);
}

TEST(Fuzz, MutationsAreReadOrLocated) {
    std::mt19937 random(20);
    auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
    const std::vector<std::string> texts = samples();
    const std::string_view bytes = "\n\n  \t#:,-[]{}'\"|>&*!?%@`~\\()ab1.\xc3\xa9\xff";
    int read = 0;
    const int rounds = 6000;
    for (int round = 0; round < rounds && !testing::Test::HasFailure(); ++round) {
        std::string text = texts[below(texts.size())];
        for (std::size_t edits = 1 + below(4); edits > 0; --edits) {
            const std::size_t at = below(text.size()), length = below(12);
            switch (below(4)) {
            case 0: text[at] = bytes[below(bytes.size())]; break;
            case 1: text.insert(at, 1, bytes[below(bytes.size())]); break;
            case 2: text.erase(at, length); break;
            default: text.insert(below(text.size()), text.substr(at, length * 4)); break;
            }
        }
        read += survives(text);
    }
    EXPECT_GT(read, rounds / 20); // both outcomes occur
    EXPECT_LT(read, rounds * 19 / 20);
}

TEST(Fuzz, AnyTextOfAnExpressionIsReadBack) {
    std::mt19937 random(7);
    auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
    const std::string_view bytes = "ab1 .,:;#'\"[]{}()?!&*|>-+%@`~\\=\n\tnul";
    for (int round = 0; round < 20000 && !testing::Test::HasFailure(); ++round) {
        std::string text;
        for (std::size_t length = 1 + below(9); length > 0; --length) text += bytes[below(bytes.size())];
        model::Model written{.name = "m"};
        const auto quotes = static_cast<model::Quotes>(below(4));
        model::Block block{.name = "a", .type = "T"};
        block.settings.push_back({.name = "k", .value = {.text = text, .quotes = quotes}});
        written.root.blocks.push_back(std::move(block));
        const std::string yaml = canonical_yaml(written);
        try {
            const model::Model read = read_yaml_text(yaml);
            ASSERT_EQ(read.root.blocks.at(0).settings.size(), 1u) << yaml;
            EXPECT_EQ(read.root.blocks.at(0).settings.at(0).value.matlab(),
                      written.root.blocks[0].settings[0].value.matlab())
                << yaml;
            EXPECT_EQ(canonical_yaml(read), yaml);
        } catch (const model::Errors& errors) {
            ADD_FAILURE() << errors.what() << "\n" << yaml;
        }
    }
}

TEST(Fuzz, AnyTextForPeopleIsReadBack) {
    std::mt19937 random(8);
    auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
    const std::string_view bytes = "ab :#'\"-[]|>%\\\n\n\n\t  ";
    for (int round = 0; round < 10000 && !testing::Test::HasFailure(); ++round) {
        std::string text;
        for (std::size_t length = 1 + below(9); length > 0; --length) text += bytes[below(bytes.size())];
        while (text.ends_with('\n')) text.pop_back(); // a text ends with its last line
        model::Model written{.name = "m", .doc = text};
        written.layout.notes.push_back({.name = "n", .text = text});
        const std::string yaml = canonical_yaml(written);
        try {
            const model::Model read = read_yaml_text(yaml);
            EXPECT_EQ(read.doc, text) << yaml;
            EXPECT_EQ(read.layout.notes.at(0).text, text) << yaml;
            EXPECT_EQ(canonical_yaml(read), yaml);
        } catch (const model::Errors& errors) {
            ADD_FAILURE() << errors.what() << "\n" << yaml;
        }
    }
}

std::string chain(int blocks) {
    std::ostringstream text;
    text << "model: large\nblocks:\n";
    for (int i = 0; i < blocks; ++i) text << "  gain_" << i << ": {block: Gain, K: [1, 2; 3, " << i << "]}\n";
    text << "connections:\n";
    for (int i = 1; i < blocks; ++i) text << "  gain_" << i - 1 << ": gain_" << i << "\n";
    return text.str();
}

TEST(Growth, OfReadingAndWriting) {
    const std::string small = chain(2000), large = chain(8000);
    const model::Model small_model = read_yaml_text(small), large_model = read_yaml_text(large);
    EXPECT_EQ(canonical_yaml(large_model), large);
    test::expect_growth(
        "reading", [&] { read_yaml_text(small); }, [&] { read_yaml_text(large); });
    test::expect_growth(
        "writing", [&] { canonical_yaml(small_model); }, [&] { canonical_yaml(large_model); });
}

} // namespace
} // namespace bf::formats
