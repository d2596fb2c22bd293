
  // The functions and models below are part of crumple. Copyright (c) 2026 The crumple authors
  // SPDX-License-Identifier: MIT OR Apache-2.0
  function loading "Force of the loading branch, N; beyond the table the last slope goes on"
    input Real x "Deflection, m";
    output Real y;
  algorithm
    y := 0.0;
    for i in 1:points loop
      if x >= d[i] then
        y := f[i] + slope[i] * (x - d[i]);
      end if;
    end for;
  end loading;

  function worked "Work done on the loading branch, J"
    input Real x "Deflection, m";
    output Real y;
  algorithm
    y := 0.0;
    for i in 1:points loop
      if x >= d[i] then
        y := work[i] + (f[i] + 0.5 * slope[i] * (x - d[i])) * (x - d[i]);
      end if;
    end for;
  end worked;

  function lostUpTo "Energy lost at the last point of the table before the deflection, J"
    input Real x "Deflection, m";
    output Real y;
  algorithm
    y := 0.0;
    for i in 1:points loop
      if x >= d[i] then
        y := lost[i];
      end if;
    end for;
  end lostUpTo;

  function stored "Energy that comes back from the maximum deflection, J"
    input Real largest "m";
    output Real y;
  protected
    Real top;
    Real own;
    Real least;
    Real done;
  algorithm
    top := loading(largest);
    done := worked(largest);
    own := top * min(0.5 * top / stiffness, 0.5 * largest);
    least := top * min(0.5 * top / steepest, 0.5 * largest);
    y := max(done - max(lostUpTo(largest), done - own), least);
  end stored;

  function force "Force, N, after the deflection has once been the largest"
    input Real x "Deflection, m, compression positive";
    input Real largest "Maximum deflection so far, m";
    output Real y;
  protected
    Real top;
    Real length;
  algorithm
    if x <= 0.0 then
      y := 0.0;
    elseif x >= largest then
      y := loading(x);
    else
      top := loading(largest);
      length := 2.0 * stored(largest) / max(top, 1.0e-9);
      y := max(0.0, top * (1.0 - (largest - x) / max(length, 1.0e-12)));
    end if;
  end force;

  model Spring "Interface: deflection and its rate in, force out"
    input Real x "Deflection, m, compression positive";
    input Real v "Rate of the deflection, m/s";
    parameter Real force_scale = 1.0 "Factor of the force";
    output Real F "Force that pushes the bodies apart, N";
    discrete Real largest(start = 0.0, fixed = true) "Maximum deflection so far, m";
  equation
    when v < 0.0 then
      largest = max(pre(largest), x);
    end when;
    F = force_scale * force(x, largest);
  end Spring;

  model Impact "One mass on the spring, at the speed that the curve belongs to"
    parameter Real m = impact_mass "Mass, kg; the reduced one of a pair";
    parameter Real v0 = impact_speed "Speed, m/s";
    Real x(start = 0.0, fixed = true) "Deflection, m";
    Real v(start = v0, fixed = true) "Its rate, m/s";
    Real F "Force, N";
    discrete Real largest(start = 0.0, fixed = true) "Maximum deflection so far, m";
  equation
    der(x) = v;
    m * der(v) = -F;
    F = force(x, largest);
    when v < 0.0 then
      largest = max(pre(largest), x);
    end when;
  end Impact;
