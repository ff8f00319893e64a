# The target `docs` makes the reference of the public interface, where Doxygen is there. A warning is an error.
find_program(DOXYGEN_PROGRAM doxygen)
if(DOXYGEN_PROGRAM)
  configure_file(docs/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
  add_custom_target(docs COMMAND ${DOXYGEN_PROGRAM} ${PROJECT_BINARY_DIR}/Doxyfile VERBATIM
    COMMENT "Reference in ${PROJECT_BINARY_DIR}/docs/html/index.html")
  if(SPLITCUBES_BUILD_TESTS)
    add_test(NAME api_reference COMMAND ${DOXYGEN_PROGRAM} ${PROJECT_BINARY_DIR}/Doxyfile)
    set_tests_properties(api_reference PROPERTIES TIMEOUT 60 LABELS api)
  endif()
endif()
