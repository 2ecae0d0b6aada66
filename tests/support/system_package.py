"""Packages that not every system has."""
import os


def lacking(package: str) -> str:
    """Why a test cannot run without a package: ./run says which of them this system does not have."""
    is_absent = package in os.environ.get("CIE_NO_PACKAGES", "").split()
    return f"not possible here: this system has no package {package}" if is_absent else f"{package} is not installed"
