# Run by CPack when the components are staged: makes of them what Debian's policy asks of packages.
execute_process(COMMAND ${CPACK_BISECTOR_SOURCE}/packaging/debian/finish ${CPACK_TEMPORARY_DIRECTORY}
                COMMAND_ERROR_IS_FATAL ANY)
