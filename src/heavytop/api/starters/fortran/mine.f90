! The heavy top by the classical Runge-Kutta method: requests on standard input, answers on standard output.
module heavy_top
  implicit none
  integer, parameter :: dp = kind(1.0d0)
  real(dp) :: inertia(3), n(3)   ! principal moments I; n = P r
contains
  ! Omega' and gamma' of M' = M x Omega + P gamma x r, gamma' = gamma x Omega; M = I Omega
  function field(y) result(f)
    real(dp), intent(in) :: y(6)
    real(dp) :: f(6), w(3), g(3)
    w = y(1:3)
    g = y(4:6)
    f(1) = ((inertia(2) - inertia(3)) * w(2) * w(3) + g(2) * n(3) - g(3) * n(2)) / inertia(1)
    f(2) = ((inertia(3) - inertia(1)) * w(3) * w(1) + g(3) * n(1) - g(1) * n(3)) / inertia(2)
    f(3) = ((inertia(1) - inertia(2)) * w(1) * w(2) + g(1) * n(2) - g(2) * n(1)) / inertia(3)
    f(4) = g(2) * w(3) - g(3) * w(2)
    f(5) = g(3) * w(1) - g(1) * w(3)
    f(6) = g(1) * w(2) - g(2) * w(1)
  end function

  ! y after one step of size h: replace this by your method
  function step(y, h) result(z)
    real(dp), intent(in) :: y(6), h
    real(dp) :: z(6), k1(6), k2(6), k3(6), k4(6)
    k1 = field(y)
    k2 = field(y + h / 2 * k1)
    k3 = field(y + h / 2 * k2)
    k4 = field(y + h * k3)
    z = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
  end function
end module

program mine
  use heavy_top
  implicit none
  character(len=2000000) :: line
  character(len=40) :: name
  real(dp) :: y(6), h, t, length
  real(dp), allocatable :: times(:)
  integer :: count, status, i, k, parts, steps
  h = 0.01_dp
  do
    read (*, '(a)', iostat=status) line
    if (status /= 0) exit
    read (line, *) name
    select case (name)
    case ('heavytop-integrator')
      print '(a)', 'ready mine 1.0'
    case ('inertia')
      read (line, *) name, inertia
    case ('moment')
      read (line, *) name, n
    case ('state')
      read (line, *) name, y
    case ('setting')
      read (line, *) name, h
    case ('times')
      read (line, *) name, count
      if (allocated(times)) deallocate (times)
      allocate (times(count))
      read (line, *) name, count, times
    case ('go')
      t = 0
      steps = 0
      do i = 1, count
        parts = ceiling(abs(times(i) - t) / h)
        if (parts > 0) length = (times(i) - t) / parts
        do k = 1, parts
          y = step(y, length)
        end do
        t = times(i)
        steps = steps + parts
        print '(a, 7(1x, es24.16e3))', 'state', t, y
        flush (6)
      end do
      print '(a, i0, a, i0)', 'done steps ', steps, ' evaluations ', 4 * steps
    case ('quit')
      exit
    end select
    flush (6)
  end do
end program
