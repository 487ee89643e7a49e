#include "bf/base/escape.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace bf {
namespace {

/// What breaks out of one language or another.
const std::vector<std::string> hostile = {
    "",
    "plain name",
    "a'b\"c`d",
    "two\nlines\r\nand a tab\t",
    "*/ system(\"x\"); /*",
    "/* // \\",
    "ends with a backslash \\",
    "?\?/ ?\?' ?\?= ?\?\?!",
    "\"\"\"; import os; os.abort() #",
    "$(exit 3) `exit 3` ${HOME} $HOME",
    "; rm -rf . && echo | cat > x < y",
    "%n %s %d",
    "-o",
    "=1+1",
    "]] ]==] )",
    "größer 机器人 🤖",
    "\u202ereversed\u2066",
    std::string(3000, 'x'),
    "\x1b[2Jcleared\x07",
    "no UTF-8: \xff\xc0\x80",
};

std::string output_of(const std::string& command) {
    std::string text;
    std::FILE* pipe = ::popen(command.c_str(), "r");
    for (int c = 0; (c = std::fgetc(pipe)) != EOF;) text += static_cast<char>(c);
    return ::pclose(pipe) == 0 ? text : "(failed)";
}

std::string folder() {
    const auto made = std::filesystem::temp_directory_path() / ("bf_escape_" + std::to_string(::getpid()));
    std::filesystem::create_directories(made);
    return made.string();
}

TEST(Escape, GivesCompilersTheTextBack) {
    const std::string at = folder();
    std::string code = "#include <stdio.h>\nint main(void) {\n";
    std::string expected;
    for (const auto& text : hostile) {
        code += "    // " + escape::comment(text) + "\n    /* " + escape::comment(text) + " */\n    fputs(" +
                escape::cpp(text) + ", stdout); putchar('\\n');\n";
        expected += text + "\n";
    }
    std::ofstream(at + "/x.c") << code << "    return 0;\n}\n";
    std::ofstream(at + "/x.cpp") << code << "    return 0;\n}\n";
    // With trigraphs, as C++14 and C11 have them, and with every warning an error.
    for (const char* command :
         {"cc -std=c11 -Wall -Wextra -Werror -x c ", "c++ -std=c++14 -Wall -Wextra -Werror ",
          "c++ -std=gnu++20 -Wall -Wextra -Werror "}) {
        const std::string program = at + "/x";
        EXPECT_EQ(output_of(command + at + (std::string(command)[1] == 'c' ? "/x.c" : "/x.cpp") + " -o " +
                            program + " && " + program),
                  expected)
            << command;
    }
    std::filesystem::remove_all(at);
}

TEST(Escape, GivesPythonAndJsonTheTextBack) {
    const std::string at = folder();
    std::string code = "import json\nfor a, b in [\n", expected;
    for (const auto& text : hostile) {
        const std::string literal = escape::python(text);
        code +=
            "    (" + literal + ", json.loads(r'''" + literal + "''')),  # " + escape::comment(text) + "\n";
    }
    // A single quote thrice would end the raw literal of this test, and is not among the texts.
    std::ofstream(at + "/x.py") << code
                                << "]:\n    assert a == b, (a, b)\n    print(a.encode('utf-8').hex())\n";
    for (const auto& text : hostile) {
        std::string shown;
        for (const char c : text.starts_with("no UTF-8") ? "no UTF-8: \ufffd\ufffd\ufffd" : text) {
            char digits[3];
            std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned char>(c));
            shown += digits;
        }
        expected += shown + "\n";
    }
    EXPECT_EQ(output_of(std::string(BF_PYTHON) + " -I " + at + "/x.py"), expected);
    std::filesystem::remove_all(at);
}

TEST(Escape, GivesReadersOfUrisThePathBack) {
    const std::string at = folder();
    for (const auto& text : hostile) {
        std::ofstream(at + "/x.py") << "import sys, urllib.parse\nsys.stdout.buffer.write("
                                       "urllib.parse.unquote_to_bytes('" +
                                           escape::uri(text) + "'))\n";
        EXPECT_EQ(output_of(std::string(BF_PYTHON) + " -I " + at + "/x.py"), text);
    }
    EXPECT_EQ(escape::uri("/tmp/a b_%41.fmu/ö"), "/tmp/a%20b_%2541.fmu/%C3%B6");
    std::filesystem::remove_all(at);
}

TEST(Escape, GivesAShellAndCMakeTheTextBack) {
    const std::string at = folder();
    for (const auto& text : hostile) {
        EXPECT_EQ(output_of("printf %s " + escape::shell(text)), text);
        // CMake reads its files as text in UTF-8 without control characters.
        if (text.find('\x1b') != std::string::npos || text.starts_with("no UTF-8")) continue;
        std::ofstream(at + "/x.cmake") << "# " << escape::comment(text) << "\nset(x " << escape::cmake(text)
                                       << ")\nfile(WRITE " << escape::cmake(at + "/x.txt") << " \"${x}\")\n";
        EXPECT_EQ(output_of("cmake -P " + at + "/x.cmake && cat " + at + "/x.txt"), text);
    }
    std::filesystem::remove_all(at);
}

TEST(Escape, PutsNothingButTextIntoXml) {
    EXPECT_EQ(escape::xml("a < b && c > \"d\" 'e'"), "a &lt; b &amp;&amp; c &gt; &quot;d&quot; &#39;e&#39;");
    EXPECT_EQ(escape::xml("\x01\x7f\n\xc2\x85"), "    ");
    EXPECT_EQ(escape::xml(std::string_view("a\0b", 3)), "a b");
    EXPECT_EQ(escape::xml("\xff\xc3"), "\xef\xbf\xbd\xef\xbf\xbd");
    EXPECT_EQ(escape::xml("\xef\xbf\xbf\xe2\x80\xae"), "  ");
    EXPECT_EQ(escape::xml("τ²"), "τ²");
}

TEST(Escape, WritesFieldsOfTables) {
    EXPECT_EQ(escape::csv("tau (N m)"), "tau (N m)");
    EXPECT_EQ(escape::csv("a,\"b\"\nc"), "\"a,\"\"b\"\"\nc\"");
    EXPECT_EQ(escape::gnuplot("it's `x`\nb"), "'it'.\"'\".'s `x` b'");
    EXPECT_EQ(escape::matlab("it's\nb"), "'it''s b'");
    EXPECT_EQ(escape::markdown("a|b *c* <d>\n[e]"), "a\\|b \\*c\\* \\<d> \\[e]");
    EXPECT_EQ(escape::markdown_code(""), "");
    EXPECT_EQ(escape::markdown_code("a|b"), "`a\\|b`");
    EXPECT_EQ(escape::markdown_code("a``b`"), "``` a``b` ```");
    EXPECT_EQ(escape::markdown_code("`a"), "`` `a ``");
    EXPECT_EQ(escape::markdown_code("a`b"), "``a`b``");
}

TEST(Escape, ShortensLongTextsBetweenCharacters) {
    EXPECT_EQ(escape::shortened("short", 8), "short");
    EXPECT_EQ(escape::shortened("abcdefghijklmnop", 8), "abcdef ... (16 bytes) ... op");
    EXPECT_EQ(escape::shortened("\u00e9\u00e9\u00e9\u00e9\u00e9", 4), "\u00e9 ... (10 bytes) ... ");
}

TEST(Escape, NamesFilesAndSparesTerminals) {
    EXPECT_EQ(escape::file_name("a/b\nc.x"), "a_b_c.x");
    EXPECT_EQ(escape::file_name(std::string(119, 'x') + "größer").size(), 120u);
    EXPECT_EQ(escape::terminal("a\x1b[2J\u202e\nö\xff"), "a<1b>[2J<e2><80><ae>\nö<ff>");
}

} // namespace
} // namespace bf
