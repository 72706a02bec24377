// Only so that the headers of the test libraries are compiled once (tests/CMakeLists.txt).
