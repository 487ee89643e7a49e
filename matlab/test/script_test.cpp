#include "bf/matlab/interpreter.hpp"

#include <gtest/gtest.h>

using namespace bf::matlab;

namespace {

/// The text of `variable` after the script.
std::string after(const std::string& script, const char* variable = "y") {
    Workspace w;
    try {
        Interpreter().run(script, w);
        return w.at(variable).to_text();
    } catch (const Error& error) {
        return error.what();
    }
}

class TestHost : public Host {
  public:
    std::string read_script(const std::string& path) override {
        if (path == "robots/a.m") return "ROBOT_DOF = 23;\nConfig.ON_GAZEBO = true;";
        throw Error("no script '" + path + "'");
    }
    std::optional<std::string> find_function(const std::string& name) override {
        if (name == "wbc.skew")
            return "function S = skew(w)\nS = [0 -w(3) w(2); w(3) 0 -w(1); -w(2) w(1) 0];\n";
        if (name == "saturate") return "function y = saturate(u, umax, umin)\ny = min(max(u, umin), umax);";
        return std::nullopt;
    }
    std::optional<Value> call(const std::string& name, const std::vector<Value>&) override {
        if (name == "WBToolbox.Configuration") return Value::structure({{"RobotName", Value("")}});
        return std::nullopt;
    }
    std::string environment(const std::string& variable) override { return variable == "ROBOT" ? "a" : ""; }
    void show(const std::string& text) override { shown += text; }
    std::string shown;
};

} // namespace

TEST(Script, AssignsElementsAndGrowsArrays) {
    EXPECT_EQ(after("y(3) = 5;"), "[0 0 5]");
    EXPECT_EQ(after("y = [1;2]; y(4) = 5;"), "[1; 2; 0; 5]");
    EXPECT_EQ(after("y = 1; y(2,3) = 5;"), "[1 0 0; 0 0 5]");
    EXPECT_EQ(after("y = []; for i = 1:3, y(end+1) = i^2; end"), "[1 4 9]");
    EXPECT_EQ(after("y = []; y = [y; 1 2]; y = [y; 3 4];"), "[1 2; 3 4]");
    EXPECT_EQ(after("y = zeros(3); y(2:3, 1) = [1;2]; y(end, :) = 7;"), "[0 0 0; 1 0 0; 7 7 7]");
    EXPECT_EQ(after("y = 1:4; y(y > 2) = 0;"), "[1 2 0 0]");
    EXPECT_EQ(after("y = 1:4; y([1 3]) = [];"), "[2 4]");
    EXPECT_EQ(after("y = [1 2; 3 4]; y(1,:) = [];"), "[3 4]");
    EXPECT_EQ(after("y = []; y(:,2) = [1;2];"), "[0 1; 0 2]");
    EXPECT_EQ(after("y = int8([1 2]); y(2) = 300;"), "int8([1 127])");
    EXPECT_EQ(after("y = [1 2 3]; y(y(2)) = y(1);"), "[1 1 3]");
    EXPECT_EQ(after("y = [1 2 3]; x = y; y(1) = 9; y = x;"), "[1 2 3]");
}

TEST(Script, AssignsFieldsAndCells) {
    EXPECT_EQ(after("y.a.b = 1; y.a.c(2) = 3;"), "struct('a', struct('b', 1, 'c', [0 3]))");
    EXPECT_EQ(after("n = 'left'; y.(n) = 1; y.([n '2']) = 2;"), "struct('left', 1, 'left2', 2)");
    EXPECT_EQ(after("y{2} = 'x';"), "{[], 'x'}");
    EXPECT_EQ(after("y = {1, 2, 3}; y(2) = [];"), "{1, 3}");
    EXPECT_EQ(after("y = {}; y = [y, {'a'}]; y = [y, {'b', 'c'}];"), "{'a', 'b', 'c'}");
    EXPECT_EQ(after("y{1}.names{2} = 'q'; y = y{1}.names;"), "{[], 'q'}");
    EXPECT_EQ(after("S.field = eye(2); S.field(2, 3) = 4; y = S.field;"), "[1 0 0; 0 1 4]");
    EXPECT_EQ(after("R.N{1} = 'arm'; C.(R.N{1}) = {'e', 's'}; y = C.arm;"), "{'e', 's'}");
    EXPECT_EQ(after("[y, i] = max([3 9 4]); y = [y i];"), "[9 2]");
    EXPECT_EQ(after("[~, y] = max([3 9 4]);"), "2");
    EXPECT_EQ(after("[m, s.n] = size(zeros(2, 3)); y = [m s.n];"), "[2 3]");
    EXPECT_EQ(after("[a b] = size(zeros(2, 3)); y = [a b];"), "[2 3]");
}

TEST(Script, FollowsControlFlow) {
    EXPECT_EQ(
        after("y = 0; for i = 1:10\n if i == 3, continue, end\n if i > 5, break; end\n y = y + i;\nend"),
        "12");
    EXPECT_EQ(after("y = 0; while y < 5\n y = y + 2;\nend"), "6");
    EXPECT_EQ(after("if 0, y = 1; elseif 1, y = 2; else y = 3; end"), "2");
    EXPECT_EQ(after("if [1 1 0] y = 1; else y = 2; end"), "2");
    EXPECT_EQ(after("if [] y = 1; else y = 2; end"), "2");
    EXPECT_EQ(after("switch 'b'\n case {'a', 'b'}\n  y = 1;\n otherwise\n  y = 2;\nend"), "1");
    EXPECT_EQ(after("switch 3, case 1, y = 1; case 3, y = 3; end"), "3");
    EXPECT_EQ(after("switch 'b', case 'a', y = 1; case 'b', y = 2; end"), "2");
    EXPECT_EQ(after("y = 0; switch 'a', case 97, y = 1; end"), "0") << "text is no number";
    EXPECT_EQ(after("y = 0; switch 97, case 'a', y = 1; end"), "0");
    EXPECT_EQ(after("y = 0; switch 3, case [3 4], y = 1; end"), "0");
    EXPECT_EQ(after("y = 0; switch 4, case {3, [4 5], 4}, y = 1; end"), "1");
    EXPECT_EQ(after("switch 5, case {}, y = 1; otherwise, y = 2; end"), "2");
    EXPECT_EQ(after("[X, Y] = meshgrid([1 2 3], [4 5]); y = {X, Y};"), "{[1 2 3; 1 2 3], [4 4 4; 5 5 5]}");
    EXPECT_EQ(after("[X, Y] = meshgrid([1 2]); y = {X, Y};"), "{[1 2; 1 2], [1 1; 2 2]}");
    EXPECT_EQ(after("y = []; for c = [1 2; 3 4], y = [y sum(c)]; end"), "[4 6]");
    EXPECT_EQ(after("y = 1; for i = [], y = 2; end"), "1");
    EXPECT_EQ(after("y = ''; for c = {'a', 'b'}, y = [y c{1}]; end"), "'ab'");
    EXPECT_EQ(after("for (k = 1:3) y = k; end"), "3");
}

TEST(Script, ReadsFilesAsTheyAreFound) {
    EXPECT_EQ(after("y = 1;\r\nif y\r\n  y = 2;\r\nend"), "2");
    EXPECT_EQ(after("\xEF\xBB\xBFy = 1;"), "1");
    EXPECT_EQ(after("% caf\xE9\ny = 1 % no semicolon"), "1");
    EXPECT_EQ(after("y = 1;\n%{\ny = 2;\n%{\nnested\n%}\n%}\n"), "1");
    EXPECT_EQ(after("y = [ 1 2 % one\n   %% nothing here\n   3 ... four follows\n 4 ];"), "[1 2; 3 4]");
    EXPECT_EQ(after("x = 2; y = x';"), "2");
    EXPECT_EQ(after("x = {'a'}; y = [x{1}' 'b'];"), "'ab'");
    EXPECT_EQ(after("y = f(2);\nfunction r = f(x)\nr = g(x) + 1;\nfunction r = g(x)\nr = 2 * x;"), "5");
    EXPECT_EQ(after("y = f(2);\nfunction r = f(x)\nr = g(x) + 1;\nend\nfunction r = g(x)\nr = 2 * x;\nend  "),
              "5");
}

TEST(Script, ObeysCommandSyntax) {
    EXPECT_EQ(after("clc\nclose all\nclear all; y = 1;"), "1");
    EXPECT_EQ(
        after("a = 1; b = 2; c = 3;\nclearvars -except a b\ny = exist('c', 'var') + 10 * exist('a', 'var');"),
        "10");
    EXPECT_EQ(after("a = 1; b = 2;\nclear a\ny = exist('a', 'var') + 10 * exist('b', 'var');"), "10");
    EXPECT_EQ(after("hold = 3;\ny = hold -1;"), "2");
    EXPECT_EQ(after("format = 3;\nformat -x\ny = 1; x = 2;").substr(0, 4), "2:9:")
        << "a variable is no command";
    EXPECT_EQ(after("warning off\nwarning('off', 'all');\ny = 1;"), "1");
}

TEST(Script, CallsFunctionsByPositionWithPersistentVariables) {
    EXPECT_EQ(after("y = [f f f];\nfunction n = f\npersistent count\nif isempty(count), count = 0; end\n"
                    "count = count + 1; n = count;\nend"),
              "[1 2 3]");
    EXPECT_EQ(
        after("y = f(1, 2, 3);\nfunction n = f(a, varargin)\nn = a + numel(varargin) + 10 * nargin;\nend"),
        "33");
    EXPECT_EQ(after("a = 5; f = @(x) x + a; a = 100; y = f(1);"), "6");
    EXPECT_EQ(after("y = f(5);\nfunction r = f(n)\nif n <= 1\n r = 1; return\nend\nr = n * f(n - 1);\nend"),
              "120");
    EXPECT_EQ(after("y = f(5, 2);\nfunction r = f(max, min)\nr = max - min;\nend"), "3");
}

TEST(Script, ReachesItsHostOnly) {
    TestHost host;
    Interpreter interpreter(host);
    Workspace w;
    interpreter.run("run(strcat('robots/', getenv('ROBOT'), '.m'));\n"
                    "S = wbc.skew([1 2 3]');\n"
                    "import wbc.*\n"
                    "same = isequal(S, skew([1 2 3]));\n"
                    "conf = WBToolbox.Configuration; conf.RobotName = 'icub';\n"
                    "s = saturate(5, 3, 1);\n"
                    "disp('hello'); fprintf('%d\\n', 3); warning('low %s', 'gain');\n",
                    w);
    EXPECT_EQ(w.at("ROBOT_DOF").scalar(), 23);
    EXPECT_EQ(w.at("S").to_text(), "[0 -3 2; 3 0 -1; -2 1 0]");
    EXPECT_EQ(w.at("same").to_text(), "true");
    EXPECT_EQ(w.at("conf").field("RobotName").text(), "icub");
    EXPECT_EQ(w.at("s").scalar(), 3);
    EXPECT_EQ(host.shown, "hello\n3\nwarning: low gain\n");
}

TEST(Call, RunsTheFirstFunctionOfAFileAndPrefersThePathToItsName) {
    TestHost host;
    Interpreter interpreter(host);
    const auto file = parse_program("function [a, b] = saturate(u)\na = saturate(u, 2, -2);\nb = g(u);\nend\n"
                                    "function y = g(x)\ny = -x;\nend");
    const std::vector<Value> results = interpreter.call(file, {Value(5)}, 2);
    ASSERT_EQ(results.size(), 2u);
    EXPECT_EQ(results[0].scalar(), 2);
    EXPECT_EQ(results[1].scalar(), -5);
}
