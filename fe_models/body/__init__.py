"""What a finite element body is: `FEBody`, its interfaces, couplings and loads."""
