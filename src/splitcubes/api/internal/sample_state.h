// The elastic samples of a body as public values.
#pragma once

#include <splitcubes/api/samples.h>

namespace splitcubes::body {
class Body;
}

namespace splitcubes::api {

SampleState sample_state_of(const body::Body& body);
std::vector<SampleLink> sample_links_of(const body::Body& body);

}  // namespace splitcubes::api
