#include "bf/base/base64.hpp"

#include <gtest/gtest.h>

namespace {

TEST(Base64, GivesTheTestVectorsOfItsDefinition) { // RFC 4648, section 10
    const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                           {"f", "Zg=="},
                                                           {"fo", "Zm8="},
                                                           {"foo", "Zm9v"},
                                                           {"foob", "Zm9vYg=="},
                                                           {"fooba", "Zm9vYmE="},
                                                           {"foobar", "Zm9vYmFy"}};
    for (const auto& [bytes, text] : vectors) EXPECT_EQ(bf::base64(bytes), text);
    EXPECT_EQ(bf::base64(std::string("\0\xff\xfe", 3)), "AP/+");
}

} // namespace
