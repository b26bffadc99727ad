# `cmake --install` gives a package that another project uses with find_package(kilvo); the target is kilvo::kilvo.
include(CMakePackageConfigHelpers)

install(TARGETS ${KILVO_MODULE_TARGETS} EXPORT kilvoTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT kilvoTargets NAMESPACE kilvo:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo)
configure_package_config_file(cmake/kilvoConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/kilvoConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo)
install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/kilvo/config)
