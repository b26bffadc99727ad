# `cmake --install` gives a package that another project uses with find_package(kilvo); the target is kilvo::kilvo.
include(CMakePackageConfigHelpers)

if(TARGET programs)
  add_dependencies(programs ${KILVO_MODULE_TARGETS})
endif()
install(TARGETS ${KILVO_MODULE_TARGETS} EXPORT kilvoTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
foreach(module ${KILVO_MODULE_TARGETS})
  get_target_property(folder ${module} SOURCE_DIR)
  file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${folder})
  install(DIRECTORY ${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${path} COMPONENT development FILES_MATCHING PATTERN "*.hpp")
endforeach()
install(EXPORT kilvoTargets NAMESPACE kilvo:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo COMPONENT development)
configure_package_config_file(cmake/kilvoConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/kilvoConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo COMPONENT development)
install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/kilvo/config COMPONENT program)
include(cmake/debian.cmake)
