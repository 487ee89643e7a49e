#include "bf/base/files.hpp"
#include "bf/fmi/ssp.hpp"

#include <fstream>
#include <gtest/gtest.h>

namespace bf::fmi::test {
namespace {

namespace fs = std::filesystem;

const std::string namespaces = " xmlns:ssd=\"http://ssp-standard.org/SSP1/SystemStructureDescription\""
                               " xmlns:ssc=\"http://ssp-standard.org/SSP1/SystemStructureCommon\""
                               " xmlns:ssv=\"http://ssp-standard.org/SSP1/SystemStructureParameterValues\""
                               " xmlns:ssm=\"http://ssp-standard.org/SSP1/SystemStructureParameterMapping\"";

struct Systems : ::testing::Test {
    Systems() {
        write("resources/a.fmu", "");
        write("resources/b b.fmu", "");
    }
    void write(const std::string& name, const std::string& text) const {
        const fs::path file = folder.path() / name;
        fs::create_directories(file.parent_path());
        std::ofstream(file, std::ios::binary) << text;
    }
    /// Two components, of which a.y drives b.u, with `inside` in the system and `more` behind it.
    static std::string document(const std::string& inside, const std::string& more = "",
                                const std::string& connections =
                                    "<ssd:Connection startElement=\"a\" startConnector=\"y\" "
                                    "endElement=\"b\" endConnector=\"u\"/>") {
        return "<ssd:SystemStructureDescription version=\"2.0\" name=\"two\"" + namespaces +
               "><ssd:System name=\"root\">" + inside +
               "<ssd:Elements>"
               "<ssd:Component name=\"a\" source=\"resources/a.fmu\"><ssd:Connectors>"
               "<ssd:Connector name=\"y\" kind=\"output\"><ssc:Float64 unit=\"deg\"/></ssd:Connector>"
               "</ssd:Connectors></ssd:Component>"
               "<ssd:Component name=\"b\" source=\"resources/b%20b.fmu\" "
               "implementation=\"ModelExchange\"><ssd:Connectors>"
               "<ssd:Connector name=\"u\" kind=\"input\"><ssc:Float64 unit=\"rad\"/></ssd:Connector>"
               "<ssd:Connector name=\"w\" kind=\"output\"><ssc:Int32/><ssc:Dimension "
               "size=\"3\"/></ssd:Connector>"
               "</ssd:Connectors></ssd:Component>"
               "</ssd:Elements><ssd:Connections>" +
               connections +
               "</ssd:Connections></ssd:System><ssd:Units>"
               "<ssc:Unit name=\"rad\"><ssc:BaseUnit rad=\"1\"/></ssc:Unit>"
               "<ssc:Unit name=\"deg\"><ssc:BaseUnit rad=\"1\" factor=\"0.015625\" "
               "offset=\"2\"/></ssc:Unit></ssd:Units>" +
               more + "</ssd:SystemStructureDescription>";
    }
    SystemStructure read(const std::string& text) const {
        write("SystemStructure.ssd", text);
        return read_system(folder.path(), package);
    }
    std::string refusal(const std::string& text) const {
        try {
            read(text);
        } catch (const FmuError& error) {
            const std::string said = error.what();
            EXPECT_TRUE(said.starts_with("x.ssp: ")) << said;
            return said.substr(7);
        }
        return "none";
    }
    static std::string connection(const std::string& attributes, const std::string& inside = "") {
        return "<ssd:Connection " + attributes + ">" + inside + "</ssd:Connection>";
    }
    TemporaryFolder folder{"ssp_test"};
    std::string package = "x.ssp";
};

TEST_F(Systems, AreReadWithSourcesKindsSizesAndConversionsOfUnits) {
    const auto its = read(document("", "<ssd:DefaultExperiment startTime=\"0\" stopTime=\"2.5\"/>"));
    EXPECT_EQ(its.name, "two");
    EXPECT_EQ(its.stop, 2.5);
    ASSERT_EQ(its.system.elements.size(), 2u);
    const auto& b = its.system.elements[1];
    EXPECT_EQ(b.source, "resources/b b.fmu");
    EXPECT_EQ(b.kind, Kind::model_exchange);
    EXPECT_FALSE(its.system.elements[0].kind);
    EXPECT_EQ(b.find("w")->dimensions, std::vector<int>{3});
    EXPECT_EQ(b.find("w")->type, Type::int32);
    // base = x / 64 + 2 in both.
    ASSERT_EQ(its.system.wires.size(), 1u);
    EXPECT_EQ(its.system.wires[0].conversion, (Linear{0.015625, 2}));
}

TEST_F(Systems, ConvertUnitsBeforeTheirOwnTransformationAndNotWhereTheySaySo) {
    const std::string ends = "startElement=\"a\" startConnector=\"y\" endElement=\"b\" endConnector=\"u\"";
    const std::string change = "<ssc:LinearTransformation factor=\"4\" offset=\"1\"/>";
    EXPECT_EQ(read(document("", "", connection(ends, change))).system.wires[0].conversion,
              (Linear{0.0625, 9}));
    EXPECT_EQ(read(document("", "", connection(ends + " suppressUnitConversion=\"true\"", change)))
                  .system.wires[0]
                  .conversion,
              (Linear{4, 1}));
}

TEST_F(Systems, FindTheSourceOfAConnectionByTheKindsOfItsEnds) {
    const auto its = read(
        document("", "",
                 connection("startElement=\"b\" startConnector=\"u\" endElement=\"a\" endConnector=\"y\"",
                            "<ssd:ConnectionGeometry pointsX=\"1 2\" pointsY=\"3 4\"/>")));
    const auto& wire = its.system.wires.at(0);
    EXPECT_EQ(wire.from_element + "." + wire.from + " " + wire.to_element + "." + wire.to, "a.y b.u");
    EXPECT_EQ(wire.xs, (std::vector<double>{2, 1}));
}

TEST_F(Systems, TakeParametersFromSetsThroughPrefixesAndMappings) {
    write("resources/values.ssv",
          "<ssv:ParameterSet version=\"2.0\" name=\"v\"" + namespaces +
              "><ssv:Parameters>"
              "<ssv:Parameter name=\"k\"><ssv:Real value=\"0.1\"/></ssv:Parameter>"
              "<ssv:Parameter name=\"m\"><ssv:Float64 value=\"1 2 3 4 5 6\"/>"
              "<ssc:Dimension size=\"2\"/><ssc:Dimension size=\"3\"/></ssv:Parameter>"
              "<ssv:Parameter name=\"on\"><ssv:Boolean value=\"true\"/></ssv:Parameter>"
              "<ssv:Parameter name=\"mode\"><ssv:Enumeration value=\"fast\" name=\"Mode\"/></ssv:Parameter>"
              "</ssv:Parameters><ssv:Enumerations><ssc:Enumeration name=\"Mode\">"
              "<ssc:Item name=\"slow\" value=\"-1\"/><ssc:Item name=\"fast\" value=\"7\"/>"
              "</ssc:Enumeration></ssv:Enumerations></ssv:ParameterSet>");
    write("resources/names.ssm",
          "<ssm:ParameterMapping version=\"1.0\"" + namespaces +
              "><ssm:MappingEntry source=\"a.k\" target=\"b.gain\">"
              "<ssc:LinearTransformation factor=\"10\" offset=\"-1\"/></ssm:MappingEntry>"
              "<ssm:MappingEntry source=\"a.k\" target=\"b.other\"/></ssm:ParameterMapping>");
    const std::string
        all = "<ssd:ParameterBinding source=\"resources/values.ssv\" prefix=\"a.\"/>",
        mapped = "<ssd:ParameterBinding source=\"resources/values.ssv\" prefix=\"a.\">"
                 "<ssd:ParameterMapping source=\"resources/names.ssm\"/></ssd:ParameterBinding>",
        inline_set =
            "<ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version=\"1.0\" name=\"i\">"
            "<ssv:Parameters><ssv:Parameter name=\"x\"><ssv:Integer value=\"3\"/></ssv:Parameter>"
            "</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding>";
    const auto its =
        read(document("<ssd:ParameterBindings>" + all + mapped + inline_set + "</ssd:ParameterBindings>"));
    std::string found;
    for (const auto& p : its.system.parameters) {
        found += p.name + " =";
        for (const double x : p.values) found += " " + std::to_string(x).substr(0, 4);
        found += "; ";
    }
    EXPECT_EQ(found, "a.k = 0.10; a.m = 1.00 2.00 3.00 4.00 5.00 6.00; a.on = 1.00; a.mode = 7.00; "
                     "b.gain = 0.00; b.other = 0.10; x = 3.00; ");
    EXPECT_EQ(its.system.parameters[1].dimensions, (std::vector<int>{2, 3}));
}

TEST_F(Systems, FindItemsOfEnumerationsInTheSetAndThenInTheDocumentAroundIt) {
    const auto enumeration = [](const std::string& name, const std::string& value) {
        return "<ssc:Enumeration name=\"" + name + "\"><ssc:Item name=\"fast\" value=\"" + value +
               "\"/></ssc:Enumeration>";
    };
    const auto parameter = [](const std::string& type) {
        return "<ssv:Parameter name=\"" + type + "\"><ssv:Enumeration value=\"fast\" name=\"" + type +
               "\"/></ssv:Parameter>";
    };
    const auto its = read(document(
        "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet "
        "version=\"1.0\" name=\"i\"><ssv:Parameters>" +
            parameter("Outer") + parameter("Both") + "</ssv:Parameters><ssv:Enumerations>" +
            enumeration("Both", "2") +
            "</ssv:Enumerations></ssv:ParameterSet></ssd:ParameterValues>"
            "</ssd:ParameterBinding></ssd:ParameterBindings>",
        "<ssd:Enumerations>" + enumeration("Outer", "7") + enumeration("Both", "1") + "</ssd:Enumerations>"));
    ASSERT_EQ(its.system.parameters.size(), 2u);
    EXPECT_EQ(its.system.parameters[0].values, std::vector<double>{7});
    EXPECT_EQ(its.system.parameters[1].values, std::vector<double>{2});
}

TEST_F(Systems, AreTheSameWhenWrittenAndReadAgain) {
    auto its = read(
        document("", "<ssd:DefaultExperiment startTime=\"0\" stopTime=\"2.5\"/>",
                 connection("startElement=\"a\" startConnector=\"y\" endElement=\"b\" endConnector=\"u\" "
                            "suppressUnitConversion=\"true\"",
                            "<ssd:ConnectionGeometry pointsX=\"1 2.5\" pointsY=\"3 -4\"/>")));
    its.units = {{"rad", {0, 0, 0, 0, 0, 0, 0, 1}}};
    for (auto& e : its.system.elements)
        for (auto& c : e.connectors) c.unit.clear();
    Ticks ticks;
    ticks.interval = 0.1;
    ticks.shift = 0.05;
    ticks.resolution = 20, ticks.interval_count = 2, ticks.shift_count = 1;
    its.system.elements[0].connectors.push_back({"tick", Causality::input, Type::clock, {}, {}, ticks, {}});
    its.system.elements[0].connectors[0].clocks = {"tick"};
    its.own = {{"step", "0.01"}};
    its.record = {"a.y", "b.<w>"};
    its.system.elements[0].place = Place{0, 1, 10, -5, 90};
    its.system.elements[0].own = {{"period", "0.02"}};
    its.system.elements[0].doc = "a \"first\" one";
    its.system.parameters = {{"a.k", Type::float64, {0.1}, {}, "rad"},
                             {"b.n", Type::int32, {1, 2}, {}, {}, {2}}};
    const std::string text = to_ssd(its);
    EXPECT_NE(text.find("version=\"2.0\""), std::string::npos);
    write("resources/parameters.ssv", to_ssv(its));
    const auto again = read(text);
    EXPECT_EQ(to_ssd(again), text);
    EXPECT_EQ(to_ssv(again), to_ssv(its));
    EXPECT_EQ(again.record, its.record);
    EXPECT_EQ(again.system.elements[0].find("tick")->ticks->shift_count, 1u);
    EXPECT_EQ(again.system.elements[0].find("y")->type, Type::float64);
    EXPECT_EQ(again.system.elements[0].doc, its.system.elements[0].doc);
}

TEST_F(Systems, AreWrittenAsTheFirstVersionWhereThatHasAll) {
    auto its = read(document(""));
    its.has_fmi_3 = false;
    its.system.elements[1].connectors.pop_back();
    const std::string text = to_ssd(its);
    EXPECT_NE(text.find("version=\"1.0\""), std::string::npos) << text;
    EXPECT_NE(text.find("<ssc:Real unit=\"rad\"/>"), std::string::npos) << text;
}

TEST_F(Systems, KnowTheClockOfAConnectorFromTheTypeOfAClock) {
    std::string text = document("");
    const std::string type = "<ssc:Float64 unit=\"deg\"/>";
    text.replace(text.find(type), type.size(), "<ssd:Clock name=\"tick\"/>");
    EXPECT_EQ(refusal(text), "SystemStructure.ssd:1: 'y' has the clock 'tick', which is no clock of 'a' (SSP "
                             "2.0, section 5.2.1)");
    const std::string connectors = "<ssd:Connectors>";
    text.replace(text.find(connectors), connectors.size(),
                 connectors + "<ssd:Connector name=\"tick\" kind=\"input\"><ssc:Clock/></ssd:Connector>");
    const auto its = read(text);
    const auto* const y = its.system.elements[0].find("y");
    EXPECT_FALSE(y->type);
    EXPECT_EQ(y->clocks, std::vector<std::string>{"tick"});
    EXPECT_EQ(its.system.elements[0].find("tick")->type, Type::clock);
}

TEST_F(Systems, AreRefusedWhereTheyContradictThemselves) {
    const std::string ends = "startElement=\"a\" startConnector=\"y\" endElement=\"b\" endConnector=\"u\"";
    const auto of = [&](const std::string& connections) { return refusal(document("", "", connections)); };
    const std::string at = "SystemStructure.ssd:1: ";
    EXPECT_EQ(of(connection(ends) + connection(ends)),
              at + "two connections lead to 'b.u' (SSP 2.0, section 5.3.2)");
    EXPECT_EQ(of(connection("startElement=\"c\" startConnector=\"y\" endElement=\"b\" endConnector=\"u\"")),
              at + "there is no element 'c' to connect");
    EXPECT_EQ(of(connection("startElement=\"a\" startConnector=\"z\" endElement=\"b\" endConnector=\"u\"")),
              at + "'a' has no connector 'z' to connect (SSP 2.0, section 5.3.2)");
    EXPECT_EQ(of(connection("startElement=\"a\" startConnector=\"y\" endElement=\"b\" endConnector=\"w\"")),
              at + "'y' and 'w' are no source and destination of a value (SSP 2.0, section 5.3.2)");
    EXPECT_EQ(of(connection(ends + " startIndices=\"1\"")),
              at + "connections of elements of an array are not known here; connect whole arrays");
    EXPECT_EQ(of(connection("startConnector=\"y\" endElement=\"b\" endConnector=\"u\"")),
              at + "'root' has no connector 'y' to connect (SSP 2.0, section 5.3.2)");
    std::string text = document("");
    const auto changed = [&](const std::string& from, const std::string& to) {
        std::string other = text;
        other.replace(other.find(from), from.size(), to);
        return refusal(other);
    };
    EXPECT_EQ(changed("name=\"b\" source", "name=\"a\" source"),
              at + "two elements are called 'a' (SSP 2.0, section 5.3.1)");
    EXPECT_EQ(changed("name=\"w\" kind", "name=\"u\" kind"),
              at + "two connectors of 'b' are called 'u' (SSP 2.0, section 5.2.1)");
    EXPECT_EQ(changed("rad=\"1\" factor", "m=\"1\" factor"),
              at + "from 'deg' to 'rad' there is no conversion; define both as units of one quantity, or say "
                   "suppressUnitConversion (SSP 2.0, section 4.5)");
    EXPECT_EQ(changed("factor=\"0.015625\"", "factor=\"0\""),
              at + "the factor of a unit is not 0, and both it and the offset are finite");
    EXPECT_EQ(changed("version=\"2.0\"", "version=\"3.0\""),
              at + "it is of SSP version '3.0', but 1.0 and 2.0 are known");
    EXPECT_EQ(changed("size=\"3\"", "size=\"1e30\""), at + "a size of '1e30' cannot be");
    EXPECT_EQ(changed("implementation=\"ModelExchange\"", "type=\"text/x-modelica\""),
              at + "the component 'b' is of type 'text/x-modelica', but FMUs alone are known here "
                   "(application/x-fmu-sharedlibrary)");
    EXPECT_EQ(changed("kind=\"output\"", "kind=\"inout\""),
              at + "'kind' is 'inout', but must be one of: input, output, parameter, calculatedParameter, "
                   "structuralParameter, constant, local (SSP 2.0)");
    EXPECT_NE(refusal("<ssd:SystemStructureDescription"), "none");
    EXPECT_EQ(refusal("<fmiModelDescription/>"),
              at + "its root is no <SystemStructureDescription> (SSP 2.0)");
}

TEST_F(Systems, ReadNoFileButThoseOfTheirPackage) {
    const std::string text = document("");
    write("../ssp_outside", "");
    for (const std::string source :
         {"../ssp_outside", "%2e%2e/ssp_outside", "/etc/passwd", "file:///etc/passwd", "resources/../..",
          "http://localhost/a.fmu", "resources\\a.fmu", "#other", "resources/a.fmu#x", "",
          "resources/a.fmu%00"}) {
        std::string other = text;
        other.replace(other.find("resources/a.fmu"), 15, source);
        EXPECT_EQ(refusal(other),
                  "SystemStructure.ssd:1: '" + source +
                      "' is no file of the package; only these are taken (SSP 2.0, section 5.6)");
    }
    fs::remove(folder.path().parent_path() / "ssp_outside");
    std::string other = text;
    other.replace(other.find("resources/a.fmu"), 15, "resources/c.fmu");
    EXPECT_EQ(refusal(other), "SystemStructure.ssd:1: there is no file 'resources/c.fmu' in the package");
    fs::remove(folder.path() / "SystemStructure.ssd");
    try {
        read_system(folder.path(), package);
        FAIL();
    } catch (const FmuError& error) {
        EXPECT_STREQ(error.what(), "x.ssp: it has no SystemStructure.ssd, which every system structure "
                                   "package has (SSP 2.0, chapter 3)");
    }
}

TEST_F(Systems, HaveAnEndHoweverDeepTheyStandInEachOther) {
    std::string begin, end;
    for (int i = 0; i < 150; ++i) {
        begin += "<ssd:Elements><ssd:System name=\"s\">";
        end += "</ssd:System></ssd:Elements>";
    }
    EXPECT_EQ(refusal("<ssd:SystemStructureDescription version=\"2.0\" name=\"deep\"" + namespaces +
                      "><ssd:System name=\"s\">" + begin + end +
                      "</ssd:System></ssd:SystemStructureDescription>"),
              "SystemStructure.ssd:1: systems stand too deep in each other");
}

} // namespace
} // namespace bf::fmi::test
